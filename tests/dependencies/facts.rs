//! What is so of each crate that a manifest names.

use std::collections::{BTreeMap, BTreeSet};

use crate::{
    graph::dependencies,
    metadata::{Metadata, NodeDep, Package},
};

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
    for user in metadata.ours() {
        for dependency in dependencies(metadata, &user.id) {
            let package = metadata.package(&dependency.pkg);
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
    let version = package.version.split('+').next().unwrap_or_default();
    let (number, pre) = version.split_once('-').unwrap_or((version, ""));
    let major_and_minor: Vec<_> = number.split('.').take(2).collect();
    let dash = if pre.is_empty() { "" } else { "-" };
    Name {
        name: package.name.clone(),
        version: format!("{}{dash}{pre}", major_and_minor.join(".")),
    }
}

/// As it is written today: `/` was the old sign for "or".
fn licence(package: &Package) -> String {
    let told = package.license.as_deref().unwrap_or_default();
    told.replace('/', " OR ")
}

fn purpose(dependency: &NodeDep) -> &'static str {
    let kinds = || dependency.dep_kinds.iter().map(|it| it.kind.as_deref());
    match () {
        () if kinds().any(|kind| kind.is_none()) => "",
        () if kinds().any(|kind| kind == Some("build")) => " (build)",
        () => " (tests)",
    }
}
