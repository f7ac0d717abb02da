//! Links, commands and options in the text of a page.

use std::path::{Path, PathBuf};

use crate::{page::ManualPage, root, shell::Shell};

/// Links to missing files or headings.
pub fn dead_links(page: &ManualPage) -> Vec<String> {
    let folder = Path::new(&page.name).with_file_name("");
    let links = page.links.iter().filter(|link| !link.contains("://"));
    let dead = links.filter(|link| {
        let (file, heading) = link.split_once('#').unwrap_or((link, ""));
        let path = if file.is_empty() {
            PathBuf::from(&page.name)
        } else {
            folder.join(file)
        };
        let there = root().join(&path).exists();
        let wanted = there && !heading.is_empty();
        !there || wanted && !ManualPage::read(root(), &path.display().to_string()).has(heading)
    });
    dead.map(|link| format!("{link} leads nowhere")).collect()
}

/// Commands and options in the text that are unknown to ratelab.
pub fn unknown(page: &ManualPage, shell: &Shell) -> Vec<String> {
    let help = |of: &str| shell.run(&format!("ratelab {of} --help"), true).expect(of);
    let commands = help("");
    let known = [
        "",
        "run",
        "sweep",
        "hunt",
        "exercise",
        "replay",
        "picture",
        "grade",
        "verify",
        "up",
        "node",
        "new",
        "check",
        "export",
        "export-web",
    ]
    .map(help)
    .join("");
    let mut faults = Vec::new();
    for code in &page.code {
        let ours = code
            .strip_prefix("cargo run -- ")
            .or(code.strip_prefix("ratelab "));
        let command = ours.and_then(|ours| ours.split(' ').next());
        let command = command.filter(|word| word.chars().all(char::is_lowercase));
        if command.is_some_and(|command| !commands.contains(&format!("\n  {command} "))) {
            faults.push(format!("there is no such command: {code}"));
        }
        let options = ours
            .unwrap_or(code)
            .split(' ')
            .filter(|word| word.starts_with("--"));
        let foreign = ours.is_none() && !code.starts_with("--");
        let mut options = options.filter(|option| !foreign && !known.contains(option));
        if let Some(option) = options.next() {
            faults.push(format!("there is no option {option}: {code}"));
        }
    }
    faults
}
