//! The line in which a knob is typed, with what was typed before.

use crossterm::event::{KeyCode, KeyEvent};
use ratelab::{KnobKind, Time};
use ratelab_metrics::Snapshot;
use ratelab_system::{Alias, System, names::first_alias};

use super::knobs::{Direction, neighbour, targets};

/// Maximum number of aliases, and of kinds of knobs, in a hint.
const MAX_HINTS: usize = 4;

/// Beginnings of links.
const LINKS: [&str; 6] = ["delay:", "loss:", "burst:", "in-order", "reliable:", "none"];

/// The line that is being typed.
#[derive(Default)]
pub struct Prompt {
    open: bool,
    /// The moment of the branch whose knob is typed, if it is one.
    pub branch: Option<Time>,
    typed: String,
    /// Why the last entry was refused.
    refusal: Option<String>,
    /// Earlier entries, oldest first.
    history: Vec<String>,
    /// The entry of the history that is shown, and what was typed before it.
    recalled: Option<(usize, String)>,
    /// Completions to go through, and which of them is shown.
    completions: Option<(Vec<String>, usize)>,
}

impl Prompt {
    /// Returns whether it is open.
    pub fn is_open(&self) -> bool {
        self.open
    }

    /// Returns the text so far, if it is open.
    pub fn typed(&self) -> Option<&str> {
        self.open.then_some(&*self.typed)
    }

    /// Returns why the last entry was refused.
    pub fn refusal(&self) -> Option<&str> {
        self.refusal.as_deref()
    }

    /// Returns the first words that begin as the typed one, for knobs of `system`.
    pub fn hint(&self, system: &dyn System) -> String {
        let first = self.typed.split_whitespace().next().unwrap_or_default();
        let begins = |name: &&str| name.starts_with(first);
        let aliases = system
            .knobs()
            .aliases()
            .iter()
            .map(|alias| alias.name)
            .filter(begins)
            .take(MAX_HINTS);
        let kinds = KnobKind::ALL
            .map(KnobKind::usage)
            .into_iter()
            .filter(begins)
            .take(MAX_HINTS);
        let names: Vec<&str> = aliases.chain(kinds).collect();
        let hint = match &names[..] {
            [] => "Tab goes through the knobs".to_owned(),
            names => format!("{}, …: Tab goes through them", names.join(", ")),
        };
        match self.branch {
            Some(at) => format!("the knob to turn at {at}: {hint}"),
            None => hint,
        }
    }

    /// Begins an empty line, for a knob of a `branch` with its moment.
    pub fn open(&mut self, branch: Option<Time>) {
        *self = Self {
            open: true,
            branch,
            history: std::mem::take(&mut self.history),
            ..Self::default()
        };
    }

    /// Gives back what was entered last, to be edited.
    pub fn refuse(&mut self, reason: String) {
        self.open = true;
        self.typed = self.history.last().cloned().unwrap_or_default();
        self.refusal = Some(reason);
    }

    /// Handles a key; Tab completes with `vocabulary`. Returns a complete entry.
    pub fn key(&mut self, key: &KeyEvent, vocabulary: &Vocabulary<'_>) -> Option<String> {
        match key.code {
            KeyCode::Esc => self.open = false,
            KeyCode::Enter => return self.enter(),
            KeyCode::Backspace => self.edit(|typed| {
                typed.pop();
            }),
            KeyCode::Char(letter) => self.edit(|typed| typed.push(letter)),
            KeyCode::Tab => self.complete(vocabulary, Direction::Up),
            KeyCode::BackTab => self.complete(vocabulary, Direction::Down),
            KeyCode::Up => self.recall(-1),
            KeyCode::Down => self.recall(1),
            _ => {}
        }
        None
    }

    /// Changes what is typed.
    pub fn edit(&mut self, change: impl FnOnce(&mut String)) {
        change(&mut self.typed);
        (self.recalled, self.completions, self.refusal) = (None, None, None);
    }

    fn enter(&mut self) -> Option<String> {
        self.open = false;
        let entered = self.typed.trim().to_owned();
        if entered.is_empty() {
            return None;
        }
        self.history.retain(|known| *known != entered);
        self.history.push(entered.clone());
        self.edit(String::clear);
        Some(entered)
    }

    /// Completes the last word; further on, takes the next completion of it.
    fn complete(&mut self, vocabulary: &Vocabulary<'_>, to: Direction) {
        let (texts, at) = match self.completions.take() {
            Some((texts, at)) => {
                let next = neighbour(Some(at), texts.len(), to);
                (texts, next.unwrap_or(0))
            }
            None => (vocabulary.completions(&self.typed), 0),
        };
        let Some(text) = texts.get(at).cloned() else {
            return;
        };
        self.edit(|typed| *typed = text);
        // The only one is done with, and what follows can be completed.
        self.completions = (texts.len() > 1).then_some((texts, at));
    }

    fn recall(&mut self, step: isize) {
        let (at, typed) = self
            .recalled
            .take()
            .unwrap_or_else(|| (self.history.len(), self.typed.clone()));
        let place = at.saturating_add_signed(step).min(self.history.len());
        let text = self.history.get(place).unwrap_or(&typed).clone();
        self.edit(|now| *now = text);
        self.recalled = Some((place, typed));
    }
}

/// The words that knobs of a running system consist of.
pub struct Vocabulary<'a> {
    /// Whose they are.
    pub system: &'a dyn System,
    /// Its graph.
    pub graph: Snapshot,
    /// The values that messages of the first alias are chosen from.
    pub choices: &'a [String],
}

impl Vocabulary<'_> {
    /// Returns the texts that `typed` may be the beginning of, each as far as its next word goes.
    fn completions(&self, typed: &str) -> Vec<String> {
        let typed = typed.trim_start();
        let begins = typed.rfind(char::is_whitespace).map_or(0, |at| {
            at + typed[at..].chars().next().map_or(1, char::len_utf8)
        });
        let (before, word) = typed.split_at(begins);
        let earlier: Vec<&str> = before.split_whitespace().collect();
        let (words, more) = self.next_words(&earlier);
        let blank = if more { " " } else { "" };
        words
            .iter()
            .filter(|known| known.starts_with(word))
            .map(|known| format!("{before}{known}{blank}"))
            .collect()
    }

    /// Returns the words that can come after `earlier`, and whether more must follow.
    fn next_words(&self, earlier: &[&str]) -> (Vec<&str>, bool) {
        let kind = |name: &str| KnobKind::ALL.into_iter().find(|kind| kind.name() == name);
        match earlier {
            [] => {
                let names = self
                    .aliases()
                    .map(|alias| alias.name)
                    .chain(KnobKind::ALL.map(KnobKind::name));
                (names.collect(), true)
            }
            [name] => match (kind(name), self.aliases().find(|alias| alias.name == *name)) {
                (Some(kind), _) => (targets(&self.graph, kind), true),
                (None, alias) => (self.values(alias), false),
            },
            [name, node] if kind(name) == Some(KnobKind::Send) => {
                let of_node = |alias: &&Alias| alias.knobs == [(KnobKind::Send, *node)];
                (self.values(self.aliases().find(of_node)), false)
            }
            [name, _] => match kind(name) {
                Some(KnobKind::Link) => (LINKS.to_vec(), false),
                Some(KnobKind::Read) => (vec!["newest", "oldest"], false),
                _ => (Vec::new(), false),
            },
            _ => (Vec::new(), false),
        }
    }

    fn aliases(&self) -> impl Iterator<Item = &'static Alias> {
        self.system.knobs().aliases().iter()
    }

    fn values(&self, alias: Option<&'static Alias>) -> Vec<&str> {
        match alias {
            Some(alias) if first_alias(self.system, KnobKind::Send) == Some(alias) => {
                self.choices.iter().map(String::as_str).collect()
            }
            Some(alias) => alias.choices.to_vec(),
            None => Vec::new(),
        }
    }
}
