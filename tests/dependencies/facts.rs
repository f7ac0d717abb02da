//! What is so of each crate that a manifest names.

use std::collections::{BTreeMap, BTreeSet};

use cargo_metadata::{DependencyKind, Metadata, NodeDep, Package};

use crate::graph::dependencies;

/// A crate in one of its versions.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Name {
    pub name: String,
    pub version: String,
}

/// Of a crate.
#[derive(Default)]
pub struct Facts {
    pub licence: String,
    /// Packages of ours, and whether for their tests or their build only.
    pub users: BTreeSet<String>,
}

/// Of all crates that the manifests of the workspace name.
pub fn facts(metadata: &Metadata) -> BTreeMap<Name, Facts> {
    let mut facts: BTreeMap<_, Facts> = BTreeMap::new();
    for user in metadata.workspace_packages() {
        for dependency in dependencies(metadata, &user.id) {
            let package = &metadata[&dependency.pkg];
            if package.source.is_some() {
                let of = facts.entry(name(package)).or_default();
                of.licence = licence(package);
                of.users
                    .insert(format!("{}{}", user.name, purpose(dependency)));
            }
        }
    }
    facts
}

fn name(package: &Package) -> Name {
    let version = &package.version;
    let dash = if version.pre.is_empty() { "" } else { "-" };
    Name {
        name: package.name.to_string(),
        version: format!("{}.{}{dash}{}", version.major, version.minor, version.pre),
    }
}

/// As it is written today: `/` was the old sign for "or".
fn licence(package: &Package) -> String {
    let told = package.license.as_deref().unwrap_or_default();
    told.replace('/', " OR ")
}

fn purpose(dependency: &NodeDep) -> &'static str {
    let serves = |kind| dependency.dep_kinds.iter().any(|it| it.kind == kind);
    match () {
        () if serves(DependencyKind::Normal) => "",
        () if serves(DependencyKind::Build) => " (build)",
        () => " (tests)",
    }
}
