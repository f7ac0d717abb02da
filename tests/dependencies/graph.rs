//! What cargo says of the workspace: every package of every platform, with all
//! features.

use std::{
    collections::HashSet,
    path::{Path, PathBuf},
    sync::OnceLock,
};

use crate::{
    clone,
    metadata::{Metadata, Node, NodeDep},
};

/// A file of this repository.
pub fn file(name: impl AsRef<Path>) -> PathBuf {
    clone::root().join(name)
}

/// What cargo says, or `None` where it cannot know: a build brings the crates of
/// its own platform only, and the others may not be had without a network.
///
/// # Panics
/// Where it cannot know and `RATELAB_CI` is set: there it must.
pub fn metadata() -> Option<&'static Metadata> {
    static METADATA: OnceLock<Option<Metadata>> = OnceLock::new();
    let told = METADATA.get_or_init(|| {
        let here = Metadata::ask(&["--locked", "--offline"]);
        match here.or_else(|_| Metadata::ask(&["--locked"])) {
            Ok(metadata) => Some(reached(metadata)),
            Err(error) if error.contains("failed to download") => None,
            Err(error) => panic!("cargo metadata: {error}"),
        }
    });
    if told.is_none() {
        let why = "not all crates are here; `cargo fetch` brings them";
        let must_not = std::env::var_os("RATELAB_CI").is_some();
        assert!(!must_not, "with RATELAB_CI nothing is skipped: {why}");
        eprintln!("SKIPPED: {why}");
    }
    told.as_ref()
}

/// Without packages that no build takes: cargo also names those that a feature
/// would only add to (`it?/feature`), were they there.
fn reached(mut metadata: Metadata) -> Metadata {
    let mut reached = HashSet::new();
    let mut ahead = metadata.workspace_members.clone();
    while let Some(id) = ahead.pop() {
        if reached.insert(id.clone()) {
            ahead.extend(dependencies(&metadata, &id).map(|it| it.pkg.clone()));
        }
    }
    metadata.packages.retain(|it| reached.contains(&it.id));
    metadata
}

/// What a package depends on itself.
pub fn dependencies<'a>(metadata: &'a Metadata, id: &str) -> impl Iterator<Item = &'a NodeDep> {
    let nodes = metadata.resolve.nodes.iter();
    let mut nodes = nodes.filter(move |node| node.id == *id);
    let node = nodes.next();
    node.into_iter().flat_map(|node| {
        let deps = node.deps.iter();
        deps.filter(|dep| is_taken(metadata, node, dep))
    })
}

fn is_taken(metadata: &Metadata, node: &Node, dependency: &NodeDep) -> bool {
    let (package, name) = (
        metadata.package(&node.id),
        &metadata.package(&dependency.pkg).name,
    );
    let mut named = package.dependencies.iter().filter(|it| it.name == *name);
    named.any(|it| {
        let key = it.rename.as_ref().unwrap_or(&it.name);
        let (alone, with) = (format!("dep:{key}"), format!("{key}/"));
        let takes = |what: &String| *what == alone || what.starts_with(&with);
        let mut features = node.features.iter();
        !it.optional || features.any(|on| package.features[on.as_str()].iter().any(takes))
    })
}
