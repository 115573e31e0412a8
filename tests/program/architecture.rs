//! What ARCHITECTURE.md and DESIGN.md say of the code is so.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

const ARCHITECTURE: &str = include_str!("../../ARCHITECTURE.md");
const DESIGN: &str = include_str!("../../DESIGN.md");

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The directories of all packages but the root's.
fn packages() -> Vec<PathBuf> {
    let crates = fs::read_dir(root().join("crates")).expect("crates");
    let mut all: Vec<PathBuf> = crates.map(|entry| entry.expect("readable").path()).collect();
    all.extend(["tests/blind", "tests/blind-score"].map(|package| root().join(package)));
    all
}

/// Name of a package and what it depends on, tests and benches left out.
fn manifest(package: &Path) -> (String, Vec<String>) {
    let text = fs::read_to_string(package.join("Cargo.toml")).expect("a manifest");
    let (mut name, mut section, mut dependencies) = (String::new(), "", Vec::new());
    for line in text.lines() {
        if line.starts_with('[') {
            section = line;
        } else if section == "[package]" && line.starts_with("name = ") {
            line.trim_start_matches("name = ").trim_matches('"').clone_into(&mut name);
        } else if section == "[dependencies]" && !line.is_empty() {
            let end = line.find(['.', ' ', '=']).unwrap_or(line.len());
            dependencies.push(line[..end].to_owned());
        }
    }
    (name, dependencies)
}

#[test]
fn packages_depend_on_each_other_as_told() {
    let manifests: BTreeMap<String, Vec<String>> = packages().iter().map(|package| manifest(package)).collect();
    let found: BTreeMap<String, Vec<String>> = manifests
        .iter()
        .map(|(name, all)| {
            let mut inside: Vec<String> = all.iter().filter(|name| manifests.contains_key(*name)).cloned().collect();
            inside.sort();
            (name.clone(), inside)
        })
        .collect();
    let block = ARCHITECTURE.split("```dependencies\n").nth(1).and_then(|rest| rest.split("```").next());
    let told: BTreeMap<String, Vec<String>> = block
        .expect("a list of dependencies")
        .lines()
        .map(|line| {
            let (name, inside) = line.split_once(':').expect("package: what it uses");
            (name.to_owned(), inside.split_whitespace().map(str::to_owned).collect())
        })
        .collect();
    assert_eq!(told, found);
}

/// Whether a text in backquotes looks like a path of this repository.
fn is_path(text: &str) -> bool {
    let roots = ["crates/", "src/", "tests/", "benches/", "models/", "data/", "docs/", "tables/", "python/", ".ci/"];
    roots.iter().any(|root| text.starts_with(root)) && !text.contains([' ', '<'])
}

#[test]
fn paths_in_the_documents_exist() {
    let mut checked = 0;
    for document in [ARCHITECTURE, DESIGN] {
        for text in document.split('`').filter(|text| is_path(text)) {
            assert!(root().join(text).exists(), "{text}");
            checked += 1;
        }
    }
    assert!(checked > 20, "{checked}");
}

#[test]
fn modules_of_the_code_map_exist() {
    let parts = ARCHITECTURE.split("### `").skip(1).map(|part| part.split("\n## ").next().unwrap_or(part));
    let mut checked = 0;
    for part in parts {
        let heading = part.lines().next().expect("a heading");
        let crates: Vec<PathBuf> =
            heading.split('`').filter(|text| is_path(text)).map(|text| root().join(text)).collect();
        let files =
            part.split('`').filter(|text| Path::new(text).extension().is_some_and(|e| e == "rs") && !is_path(text));
        for file in files.filter(|file| !file.contains("::")) {
            let mut homes = crates.iter().flat_map(|home| folders(&home.join("src")));
            assert!(homes.any(|folder| folder.join(file).exists()), "{file} of {heading}");
            checked += 1;
        }
    }
    assert!(checked > 50, "{checked}");
}

/// A folder and the folders in it.
fn folders(folder: &Path) -> Vec<PathBuf> {
    let inside = fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok).map(|entry| entry.path());
    std::iter::once(folder.to_owned()).chain(inside.filter(|path| path.is_dir())).collect()
}

/// The modules of a package at its top level, each with those that it names, in its tests left out.
fn modules(source: &Path) -> BTreeMap<String, BTreeSet<String>> {
    let mut all: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    let mut waiting: Vec<PathBuf> = vec![source.to_owned()];
    while let Some(path) = waiting.pop() {
        if path.is_dir() {
            waiting.extend(fs::read_dir(&path).expect("a folder").map(|entry| entry.expect("readable").path()));
            continue;
        }
        let inside = path.strip_prefix(source).expect("inside").to_str().expect("a name");
        let module = inside.split('/').next().unwrap_or(inside).trim_end_matches(".rs").to_owned();
        let is_code = path.extension().is_some_and(|extension| extension == "rs");
        if !is_code
            || ["lib", "main"].contains(&&*module)
            || ["testing.rs", "tests.rs"].iter().any(|end| path.ends_with(end))
        {
            continue;
        }
        let text = fs::read_to_string(&path).expect("readable");
        let code: String =
            text.lines().map(|line| line.split("//").next().unwrap_or_default()).collect::<Vec<_>>().join(" ");
        let code = code.split("#[cfg(test)] mod tests").next().unwrap_or_default();
        let names = all.entry(module).or_default();
        for rest in code.split("crate::").skip(1) {
            names.extend(first_names(rest));
        }
    }
    let known: BTreeSet<String> = all.keys().cloned().collect();
    for (module, names) in &mut all {
        names.retain(|name| known.contains(name) && name != module);
    }
    all
}

/// What stands behind `crate::`: a name, or several in braces.
fn first_names(rest: &str) -> Vec<String> {
    let name = |text: &str| -> String {
        text.trim().chars().take_while(|letter| letter.is_alphanumeric() || *letter == '_').collect()
    };
    let Some(group) = rest.strip_prefix('{') else { return vec![name(rest)] };
    let (mut depth, mut names, mut from) = (0, Vec::new(), 0);
    for (at, letter) in group.char_indices() {
        match letter {
            '{' => depth += 1,
            '}' | ',' if depth == 0 => {
                names.push(name(&group[from..at]));
                from = at + 1;
                if letter == '}' {
                    break;
                }
            }
            '}' => depth -= 1,
            _ => {}
        }
    }
    names
}

/// Everything that a module reaches.
fn reached<'a>(all: &'a BTreeMap<String, BTreeSet<String>>, from: &'a str) -> BTreeSet<&'a str> {
    let (mut reached, mut waiting) = (BTreeSet::new(), vec![from]);
    while let Some(module) = waiting.pop() {
        waiting.extend(all[module].iter().map(String::as_str).filter(|name| reached.insert(*name)));
    }
    reached
}

#[test]
fn modules_of_a_package_make_no_circles() {
    let mut checked = 0;
    for package in packages().into_iter().chain([root().to_owned()]) {
        let (name, _) = manifest(&package);
        let all = modules(&package.join("src"));
        for module in all.keys() {
            let circle = reached(&all, module).contains(module.as_str());
            assert!(!circle, "{name}: {module}, {:?}", all[module]);
            checked += 1;
        }
    }
    assert!(checked > 100, "{checked} modules");
}
