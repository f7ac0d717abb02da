//! The rules of `deny.toml`, read as cargo-deny reads them. A rule that is not
//! known here is refused: one that only cargo-deny keeps would not be one.

use std::fs;

use serde::Deserialize;
use spdx::{Expression, Licensee, ParseMode};

use crate::{
    graph::file,
    metadata::{Dependency, Package},
};

#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(
    dead_code,
    reason = "what is in `graph` is read to see that no more is"
)]
pub struct Rules {
    graph: Graph,
    pub licenses: Licences,
    pub bans: Bans,
    pub sources: Sources,
}

/// What is held against the rules: all features, and all platforms as none is
/// named. So is it here, see [`crate::graph`].
#[derive(Clone, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
#[expect(dead_code, reason = "it is read to see that there is no more")]
pub struct Graph {
    all_features: bool,
}

#[derive(Clone, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
#[expect(dead_code, reason = "what must be `deny` is read to see that it is")]
pub struct Licences {
    pub allow: Vec<String>,
    pub exceptions: Vec<Exception>,
    include_dev: bool,
    unused_allowed_license: Deny,
}

#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Exception {
    #[serde(rename = "crate")]
    pub name: String,
    pub allow: Vec<String>,
}

#[derive(Clone, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
#[expect(dead_code, reason = "what must be `deny` is read to see that it is")]
pub struct Bans {
    wildcards: Deny,
    allow_wildcard_paths: bool,
    multiple_versions: Allow,
}

#[derive(Clone, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
#[expect(dead_code, reason = "what must be `deny` is read to see that it is")]
pub struct Sources {
    pub allow_registry: Vec<String>,
    unknown_registry: Deny,
    unknown_git: Deny,
}

#[derive(Clone, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Deny {
    Deny,
}

#[derive(Clone, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Allow {
    Allow,
}

fn text() -> String {
    fs::read_to_string(file("deny.toml")).expect("deny.toml")
}

impl Rules {
    pub fn read() -> Self {
        Self::of(&text()).unwrap_or_else(|error| panic!("deny.toml: {error}"))
    }

    fn of(text: &str) -> Result<Self, toml::de::Error> {
        toml::from_str(text)
    }

    /// What is wrong with a crate, and what to do about it.
    pub fn wrong_with(&self, package: &Package) -> Vec<String> {
        let wrong = [self.licenses.wrong(package), self.sources.wrong(package)];
        let wildcards = package.dependencies.iter();
        let wildcards = wildcards.filter_map(|dependency| self.bans.wrong(dependency));
        let all = wrong.into_iter().flatten().chain(wildcards);
        all.map(|what| format!("{} {} {what}", package.name, package.version))
            .collect()
    }
}

impl Licences {
    fn wrong(&self, package: &Package) -> Option<String> {
        let Some(licence) = &package.license else {
            return Some("tells no licence: do without it".to_owned());
        };
        let own = self.exceptions.iter().filter(|it| it.name == package.name);
        let own = own.flat_map(|it| &it.allow).cloned();
        let granted: Vec<_> = own.chain(self.allow.iter().cloned()).collect();
        let advice = "do without it, or add an exception to deny.toml that says why";
        (!suffice(&granted, licence))
            .then(|| format!("is under {licence}, which is not allowed: {advice}"))
    }

    /// Whether `package` is here by `exception` alone.
    pub fn needs(&self, exception: &Exception, package: &Package) -> bool {
        let licence = package.license.as_deref().unwrap_or_default();
        exception.name == package.name && !suffice(&self.allow, licence)
    }
}

impl Bans {
    fn wrong(&self, dependency: &Dependency) -> Option<String> {
        let ours = self.allow_wildcard_paths && dependency.path.is_some();
        let wild = dependency.req == "*" && !ours;
        wild.then(|| format!("takes any version of {}: name one", dependency.name))
    }
}

impl Sources {
    fn wrong(&self, package: &Package) -> Option<String> {
        let source = &package.source.as_ref()?;
        let known = |registry: &String| source.as_str() == format!("registry+{registry}");
        let advice = "take it from a registry that deny.toml allows";
        (!self.allow_registry.iter().any(known)).then(|| format!("comes from {source}: {advice}"))
    }
}

/// Whether these licences are enough for an expression of them.
fn suffice(granted: &[String], expression: &str) -> bool {
    let granted: Vec<_> = granted.iter().map(|name| licensee(name)).collect();
    parsed(expression).evaluate(|asked| granted.iter().any(|it| it.satisfies(asked)))
}

/// Whether `expression` speaks of `licence`.
pub fn speaks_of(expression: &str, licence: &str) -> bool {
    let licence = licensee(licence);
    let expression = parsed(expression);
    let mut asked = expression.requirements();
    asked.any(|asked| licence.satisfies(&asked.req))
}

fn licensee(name: &str) -> Licensee {
    Licensee::parse(name).unwrap_or_else(|error| panic!("deny.toml: {error}"))
}

fn parsed(expression: &str) -> Expression {
    Expression::parse_mode(expression, ParseMode::LAX).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_rule_that_is_not_known_here_is_refused() {
    let text = text();
    let targets = text.replace("[graph]", "[graph]\ntargets = []");
    let advisories = format!("{text}\n[advisories]\nyanked = \"deny\"\n");
    for (unknown, text) in [("targets", targets), ("advisories", advisories)] {
        let error = Rules::of(&text).err().expect("refused").to_string();
        assert!(
            error.contains(&format!("unknown field `{unknown}`")),
            "{error}"
        );
    }
}
