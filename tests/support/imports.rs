//! The imports of source files, by their `use` declarations.

use std::collections::{BTreeMap, BTreeSet};

/// A module, as the names from its crate's folder down to it.
pub type Module = Vec<String>;

/// The code of each module that has a file.
pub type Sources = BTreeMap<Module, String>;

/// For each module, the modules it imports.
pub type Imports = BTreeMap<Module, BTreeSet<Module>>;

/// The imports of all modules. Re-exporting the definitions of a child module is no
/// import of it; importing such a re-export is an import of the child.
///
/// # Panics
/// If an import in `sources` has no target.
pub fn imports(sources: &Sources) -> Imports {
    let mut imports = Imports::new();
    for (module, code) in sources {
        let to = imports.entry(module.clone()).or_default();
        for (public, path) in uses(code) {
            let from =
                target(sources, module, &path).unwrap_or_else(|| panic!("{module:?}: {path}"));
            if let Some(from) = from
                && from != *module
                && !(public && from.starts_with(module))
            {
                to.insert(from);
            }
        }
    }
    imports
}

/// The modules that the paths within the code of `module` lead to, beside its imports.
pub fn named(sources: &Sources, module: &Module) -> BTreeSet<Module> {
    let code = &sources[module];
    let paths = code
        .split(|sign: char| !sign.is_alphanumeric() && !"_:".contains(sign))
        .filter(|path| path.contains("::"));
    paths
        .filter_map(|path| target(sources, module, path.trim_end_matches(':'))?)
        .collect()
}

/// The circles of imports, each with all its modules.
pub fn circles(imports: &Imports) -> BTreeSet<BTreeSet<&Module>> {
    let reached: BTreeMap<_, _> = imports.keys().map(|m| (m, reachable(imports, m))).collect();
    let circles = reached.iter().map(|(module, there)| {
        let back = there
            .iter()
            .filter(|other| reached[*other].contains(module));
        back.copied().collect()
    });
    circles
        .filter(|circle: &BTreeSet<_>| !circle.is_empty())
        .collect()
}

fn reachable<'a>(imports: &'a Imports, from: &Module) -> BTreeSet<&'a Module> {
    let mut reached = BTreeSet::new();
    let mut next: Vec<&Module> = imports[from].iter().collect();
    while let Some(module) = next.pop() {
        if reached.insert(module) {
            next.extend(&imports[module]);
        }
    }
    reached
}

/// The paths of all `use` declarations at the outermost level, and whether they
/// are public.
pub fn uses(code: &str) -> Vec<(bool, String)> {
    let mut uses = Vec::new();
    let mut lines = code.lines();
    while let Some(line) = lines.next() {
        let public = line.starts_with("pub");
        let Some((before, tree)) = line.split_once("use ") else {
            continue;
        };
        if !(before.is_empty() || public && before.ends_with(' ')) {
            continue;
        }
        let mut tree = tree.to_owned();
        while !tree.ends_with(';') {
            tree.push_str(lines.next().expect("the end of a declaration"));
        }
        let tree = tree.trim_end_matches(';').replace(" as ", "@");
        let tree: String = tree.split_whitespace().collect();
        uses.extend(paths(&tree).into_iter().map(|path| (public, path)));
    }
    uses
}

/// The paths of a tree such as `a::{b, c::{d, e}}`, with renames after an `@`.
fn paths(tree: &str) -> Vec<String> {
    let Some((head, rest)) = tree.split_once('{') else {
        return vec![tree.to_owned()];
    };
    let (mut depth, mut branches) = (0, vec![String::new()]);
    for sign in rest.strip_suffix('}').expect("closed").chars() {
        match sign {
            '{' => depth += 1,
            '}' => depth -= 1,
            _ => {}
        }
        match (sign, branches.last_mut()) {
            (',', _) if depth == 0 => branches.push(String::new()),
            (_, Some(branch)) => branch.push(sign),
            _ => {}
        }
    }
    let paths = branches
        .iter()
        .filter(|branch| !branch.is_empty())
        .flat_map(|branch| paths(branch));
    paths.map(|path| format!("{head}{path}")).collect()
}

/// The name by which other crates import the one with its sources in `folder`.
fn crate_name(folder: &str) -> String {
    let folder = folder.trim_end_matches("src").trim_end_matches('/');
    match folder.strip_prefix("crates/").unwrap_or(folder) {
        "" => "ratelab".to_owned(),
        "exercises" => "exercises".to_owned(),
        name => format!("ratelab_{}", name.replace('-', "_")),
    }
}

/// The module that defines `path` as seen from `module`, `Some(None)` for one of a crate that
/// is not in `sources`.
fn target(sources: &Sources, module: &Module, path: &str) -> Option<Option<Module>> {
    let (path, _) = path.split_once('@').unwrap_or((path, ""));
    let mut at = module.clone();
    let mut names = path.split("::").peekable();
    let first = *names.peek()?;
    let root = |module: &&Module| module.len() == 1 && crate_name(&module[0]) == first;
    match first {
        "crate" => at.truncate(1),
        "self" | "super" => {}
        child if sources.contains_key(&[&at[..], &[child.to_owned()]].concat()) => {}
        within if defines(&sources[&at], within) => return Some(Some(at)),
        _ => match sources.keys().find(root) {
            Some(root) => {
                at = root.clone();
                names.next();
            }
            None => return Some(None),
        },
    }
    for name in names {
        let child = [&at[..], &[name.to_owned()]].concat();
        match name {
            "crate" | "self" | "*" => {}
            "super" => drop(at.pop()),
            _ if sources.contains_key(&child) => at = child,
            _ if defines(&sources[&at], name) => return Some(Some(at)),
            _ => {
                let mut handed = uses(&sources[&at])
                    .into_iter()
                    .filter(|(_, other)| {
                        *other != path && other.rsplit([':', '@']).next() == Some(name)
                    })
                    .map(|(_, other)| target(sources, &at, &other));
                return handed.next().flatten();
            }
        }
    }
    Some(Some(at))
}

/// Whether `code` defines an item of this name, at its outermost level.
fn defines(code: &str, name: &str) -> bool {
    const ITEMS: [&str; 9] = [
        "struct",
        "enum",
        "trait",
        "fn",
        "const",
        "static",
        "type",
        "mod",
        "macro_rules",
    ];
    // One that a macro makes of a table.
    if code.contains(&format!("        pub enum {name} {{")) {
        return true;
    }
    let outermost = code.lines().filter(|line| !line.starts_with(' '));
    outermost.into_iter().any(|line| {
        let words = line.split(|sign: char| !sign.is_alphanumeric() && sign != '_');
        let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
        let mut pairs = words.windows(2);
        pairs.any(|pair| ITEMS.contains(&pair[0]) && pair[1] == name)
    })
}
