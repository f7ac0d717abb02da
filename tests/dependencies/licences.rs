//! Every crate keeps the rules of `deny.toml`, and every rule is needed.

use crate::{
    graph::metadata,
    metadata::Package,
    rules::{Exception, Rules, speaks_of},
};

/// What is wrong with the crates, and then with the rules.
fn wrong(rules: &Rules, packages: &[Package]) -> Vec<String> {
    let crates = packages
        .iter()
        .flat_map(|package| rules.wrong_with(package));
    crates.chain(left_over(rules, packages)).collect()
}

fn left_over(rules: &Rules, packages: &[Package]) -> Vec<String> {
    let licenses = &rules.licenses;
    let exceptions = licenses.exceptions.iter().filter(|exception| {
        let needs = |package: &Package| licenses.needs(exception, package);
        !packages.iter().any(needs)
    });
    let exceptions = exceptions.map(|it| format!("the exception for {}", it.name));
    let told = || packages.iter().filter_map(|it| it.license.as_deref());
    let unused = |name: &&String| !told().any(|licence| speaks_of(licence, name));
    let allowed = licenses.allow.iter().filter(unused).cloned();
    let all = exceptions.chain(allowed);
    all.map(|what| format!("{what} is needed by nothing: take it out of deny.toml"))
        .collect()
}

#[test]
fn every_crate_keeps_the_rules_and_every_rule_is_needed() {
    let Some(metadata) = metadata() else { return };
    let wrong = wrong(&Rules::read(), &metadata.packages);
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn a_licence_that_is_not_allowed_is_told_with_its_crates() {
    let Some(metadata) = metadata() else { return };
    let mut rules = Rules::read();
    rules.licenses.allow.retain(|name| name != "MIT");
    let wrong = wrong(&rules, &metadata.packages).join("\n");
    assert!(
        wrong.contains("is under MIT, which is not allowed"),
        "{wrong}"
    );
}

#[test]
fn a_rule_that_nothing_needs_is_told() {
    let Some(metadata) = metadata() else { return };
    let mut rules = Rules::read();
    let (name, allow) = ("serde".to_owned(), vec!["MPL-2.0".to_owned()]);
    rules.licenses.exceptions.push(Exception { name, allow });
    rules.licenses.allow.push("GPL-3.0-only".to_owned());
    let wrong = wrong(&rules, &metadata.packages).join("\n");
    for what in ["the exception for serde", "GPL-3.0-only"] {
        assert!(
            wrong.contains(&format!("{what} is needed by nothing")),
            "{wrong}"
        );
    }
}

#[test]
fn a_crate_without_a_licence_from_elsewhere_and_for_any_version_is_told() {
    let Some(metadata) = metadata() else { return };
    let root = metadata
        .ours()
        .find(|it| it.name == "ratelab")
        .expect("the root")
        .clone();
    let wrong = |change: &dyn Fn(&mut Package)| {
        let mut package = root.clone();
        change(&mut package);
        Rules::read().wrong_with(&package).join("\n")
    };
    assert_eq!(wrong(&|_| {}), "");
    assert!(wrong(&|it| it.license = None).ends_with("tells no licence: do without it"));
    let git = "git+https://example.org/it".to_owned();
    let elsewhere = wrong(&|it| it.source = Some(git.clone()));
    assert!(elsewhere.contains("comes from git+https://example.org/it"));
    let any = wrong(&|it| it.dependencies[0].req = "*".to_owned());
    assert!(
        any.ends_with("takes any version of crossbeam-channel: name one"),
        "{any}"
    );
}
