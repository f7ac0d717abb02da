//! The part of what `cargo metadata` prints that is asked for here.
//!
//! The crate `cargo_metadata` would read it too. But it asks features of crates
//! that the recorder is built on, and so `cargo test` would build the recorder
//! again: three minutes on two cores.

use std::{collections::BTreeMap, env, process::Command};

use serde::Deserialize;

use crate::graph::file;

#[derive(Deserialize)]
pub struct Metadata {
    pub packages: Vec<Package>,
    pub workspace_members: Vec<String>,
    pub resolve: Resolve,
}

#[derive(Clone, Deserialize)]
pub struct Package {
    pub id: String,
    pub name: String,
    pub version: String,
    /// An SPDX expression.
    pub license: Option<String>,
    /// Where it is from; nowhere, if it is of this workspace.
    pub source: Option<String>,
    pub dependencies: Vec<Dependency>,
    pub features: BTreeMap<String, Vec<String>>,
}

/// What a manifest asks for.
#[derive(Clone, Deserialize)]
pub struct Dependency {
    pub name: String,
    pub rename: Option<String>,
    pub req: String,
    pub optional: bool,
    pub path: Option<String>,
}

#[derive(Deserialize)]
pub struct Resolve {
    pub nodes: Vec<Node>,
}

/// What a package gets.
#[derive(Deserialize)]
pub struct Node {
    pub id: String,
    pub deps: Vec<NodeDep>,
    pub features: Vec<String>,
}

#[derive(Deserialize)]
pub struct NodeDep {
    pub pkg: String,
    pub dep_kinds: Vec<Kind>,
}

/// What a dependency is for: `None` for the package itself.
#[derive(Deserialize)]
pub struct Kind {
    pub kind: Option<String>,
}

impl Metadata {
    /// Asks cargo.
    ///
    /// # Errors
    /// What cargo said.
    pub fn ask(options: &[&str]) -> Result<Self, String> {
        let cargo = env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        let mut cargo = Command::new(cargo);
        cargo.args(["metadata", "--format-version", "1", "--all-features"]);
        cargo
            .args(options)
            .arg("--manifest-path")
            .arg(file("Cargo.toml"));
        cargo.env("CARGO_NET_RETRY", "1"); // Who has no network shall not wait for it.
        let told = cargo.output().map_err(|error| error.to_string())?;
        if told.status.success() {
            serde_json::from_slice(&told.stdout).map_err(|error| error.to_string())
        } else {
            Err(String::from_utf8_lossy(&told.stderr).into_owned())
        }
    }

    /// The package with an identifier that cargo told.
    pub fn package(&self, id: &str) -> &Package {
        let mut packages = self.packages.iter();
        packages
            .find(|package| package.id == id)
            .expect("cargo told of it")
    }

    /// The packages of this workspace.
    pub fn ours(&self) -> impl Iterator<Item = &Package> {
        self.workspace_members.iter().map(|id| self.package(id))
    }
}
