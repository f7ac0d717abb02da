//! A page of the manual, taken apart: the commands it has a reader type, the output
//! it shows for them, its links and its pictures.
//!
//! | in the page | is |
//! |---|---|
//! | a `console` block | `$ command` lines, each with its output: `[..]` stands for a part of a line that differs from run to run, `...` on a line of its own for any lines |
//! | an `sh` block | a script whose every line succeeds |
//! | `<!-- $ command -->` … `<!-- end -->` | what the command prints |
//! | anything else | prose; HTML and other blocks are refused |

use std::{fs, ops::Range, path::Path};

use pulldown_cmark::{CodeBlockKind, Event, Options, Parser, Tag, TagEnd};

/// A page.
pub struct ManualPage {
    /// Its path in the clone.
    pub name: String,
    /// All of it.
    pub text: String,
    /// What it has a reader type, in order.
    pub steps: Vec<Step>,
    /// Where its links lead.
    pub links: Vec<String>,
    /// Files of its pictures.
    pub pictures: Vec<String>,
    /// Code in its lines.
    pub code: Vec<String>,
    /// What is on it that nobody checks.
    pub unknown: Vec<String>,
}

/// Something to do.
pub struct Step {
    /// To be typed.
    pub command: String,
    pub shown: ShownOutput,
}

/// What the page says comes of it.
pub enum ShownOutput {
    /// Nothing but success.
    Success,
    /// This output, in which some parts may be left open.
    Output(Range<usize>),
    /// Exactly this part of the page, made by the command.
    Generated(Range<usize>),
}

/// What is being read.
#[derive(Default)]
enum Within {
    #[default]
    Prose,
    Fence(String, Option<Range<usize>>),
    Generated(String, usize),
}

impl ManualPage {
    pub fn read(root: &Path, name: &str) -> Self {
        let text = fs::read_to_string(root.join(name)).expect(name);
        let mut page = Self {
            name: name.to_owned(),
            text: text.clone(),
            steps: Vec::new(),
            links: Vec::new(),
            pictures: Vec::new(),
            code: Vec::new(),
            unknown: Vec::new(),
        };
        let mut within = Within::Prose;
        for (event, range) in Parser::new_ext(&text, Options::ENABLE_TABLES).into_offset_iter() {
            within = page.take(within, event, range);
        }
        assert!(matches!(within, Within::Prose), "{name}: no <!-- end -->");
        page
    }

    /// Whether a link to `anchor` finds its heading, by the rule of those who show
    /// Markdown: small letters, no punctuation, hyphens for spaces.
    pub fn has(&self, anchor: &str) -> bool {
        let headings = self.text.lines().filter_map(|line| line.strip_prefix('#'));
        let mut anchors = headings.map(|heading| {
            let heading = heading.trim_start_matches('#').trim().to_lowercase();
            let kept = heading
                .chars()
                .filter(|c| c.is_alphanumeric() || " -_".contains(*c));
            kept.map(|c| if c == ' ' { '-' } else { c })
                .collect::<String>()
        });
        anchors.any(|known| known == anchor)
    }

    fn take(&mut self, within: Within, event: Event<'_>, range: Range<usize>) -> Within {
        match (within, event) {
            (Within::Generated(command, start), Event::Html(html)) if html.trim() == END => {
                let shown = ShownOutput::Generated(start..range.start);
                self.steps.push(Step { command, shown });
                Within::Prose
            }
            (within @ Within::Generated(..), _) => within,
            (Within::Fence(info, so_far), Event::Text(_)) => {
                let start = so_far.map_or(range.start, |so_far| so_far.start);
                Within::Fence(info, Some(start..range.end))
            }
            (Within::Fence(info, content), Event::End(TagEnd::CodeBlock)) => {
                self.block(&info, content.unwrap_or_default());
                Within::Prose
            }
            (Within::Prose, Event::Start(Tag::CodeBlock(CodeBlockKind::Fenced(info)))) => {
                Within::Fence(info.to_string(), None)
            }
            (Within::Prose, Event::Html(html)) => match generator(&html) {
                Some(command) => Within::Generated(command, range.end),
                None => {
                    self.unknown.push(html.trim().to_owned());
                    Within::Prose
                }
            },
            (within, event) => {
                self.inline(event);
                within
            }
        }
    }

    fn inline(&mut self, event: Event<'_>) {
        match event {
            Event::Code(code) => self.code.push(code.to_string()),
            Event::InlineHtml(html) => self.unknown.push(html.to_string()),
            Event::Start(Tag::Link { dest_url, .. }) => self.links.push(dest_url.to_string()),
            Event::Start(Tag::Image { dest_url, .. }) => self.pictures.push(dest_url.to_string()),
            _ => {}
        }
    }

    fn block(&mut self, info: &str, content: Range<usize>) {
        match info {
            "console" => self.transcript(content),
            "sh" => self.script(content),
            _ => self
                .unknown
                .push(format!("a block of {info:?}: console or sh can be checked")),
        }
    }

    /// Commands after `$`, which go on after `>`, each followed by its output.
    fn transcript(&mut self, content: Range<usize>) {
        let before = self.steps.len();
        for line in lines(&self.text, content) {
            let text = self.text[line.clone()].trim_end();
            if let Some(command) = text.strip_prefix("$ ") {
                self.steps.push(Step {
                    command: command.to_owned(),
                    shown: ShownOutput::Output(line.end..line.end),
                });
                continue;
            }
            match (text.strip_prefix("> "), self.steps[before..].last_mut()) {
                (Some(more), Some(Step { command, shown })) => {
                    *command = format!("{command}\n{more}");
                    *shown = ShownOutput::Output(line.end..line.end);
                }
                (
                    None,
                    Some(Step {
                        shown: ShownOutput::Output(output),
                        ..
                    }),
                ) => output.end = line.end,
                _ => panic!("{}: output of no command: {text}", self.name),
            }
        }
    }

    /// A command a line, perhaps with a comment.
    fn script(&mut self, content: Range<usize>) {
        let lines = self.text[content].lines();
        let commands = lines.map(|line| line.split('#').next().unwrap_or_default().trim());
        let commands = commands.filter(|command| !command.is_empty());
        self.steps.extend(commands.map(|command| Step {
            command: command.to_owned(),
            shown: ShownOutput::Success,
        }));
    }
}

/// The lines of a part of `text`.
fn lines(text: &str, part: Range<usize>) -> Vec<Range<usize>> {
    let mut end = part.start;
    let lines = text[part].split_inclusive('\n');
    lines
        .map(|line| {
            let start = end;
            end += line.len();
            start..end
        })
        .collect()
}

const END: &str = "<!-- end -->";

/// The command that makes the following part of the page, as a comment names it.
fn generator(html: &str) -> Option<String> {
    let command = html.trim().strip_prefix("<!-- $ ")?.strip_suffix(" -->")?;
    Some(command.to_owned())
}
