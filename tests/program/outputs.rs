//! What exists is not replaced unless told to, and never what a call reads.

use std::fs;

use crate::support::{Sandbox, shown};

/// The error text of a call that must be refused before it does anything.
fn refusal(sandbox: &Sandbox, arguments: &[&str]) -> String {
    let before = sandbox.names();
    let output = sandbox.valve(arguments);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", shown(&output));
    assert!(output.stdout.is_empty(), "{arguments:?}: {}", shown(&output));
    assert_eq!(sandbox.names(), before, "{arguments:?} left something behind");
    String::from_utf8(output.stderr).unwrap()
}

#[test]
fn what_exists_is_replaced_only_with_force() {
    let sandbox = Sandbox::with_tables();
    sandbox.write("there.svg", "mine");
    sandbox.write("there.csv", "mine");
    sandbox.write("there.html", "mine");
    sandbox.write("demo/valve.toml", "mine");
    sandbox.write("man/valve.1", "mine");
    let calls: [&[&str]; 8] = [
        &["simulate", "valve.toml", "--plot", "there.svg"],
        &["simulate", "valve.toml", "--trace", "there.csv"],
        &["prognose", "log.csv", "--tables", "tables", "--plot", "there.svg"],
        &["report", "valve.toml", "--out", "there.html"],
        &["effects", "dry-friction", "--plot", "there.svg"],
        &["evaluate", "valve.toml", "--plot", "there.svg"],
        &["demo", "--files", "demo"],
        &["man", "man"],
    ];
    for call in calls {
        let refused = refusal(&sandbox, call);
        assert!(refused.contains("exists already\nhint: choose another name, or replace it with --force"), "{refused}");
    }
    let forced = sandbox.valve(&["simulate", "valve.toml", "--plot", "there.svg", "--force"]);
    assert_eq!(forced.status.code(), Some(0), "{}", shown(&forced));
    assert!(sandbox.read("there.svg").starts_with("<svg"));
    assert_eq!(sandbox.read("there.csv") + &sandbox.read("demo/valve.toml"), "minemine");
}

#[test]
fn refusals_are_told_in_words() {
    let sandbox = Sandbox::with_tables();
    fs::create_dir(sandbox.path("folder.svg")).unwrap();
    let told = |arguments: &[&str]| refusal(&sandbox, arguments);
    insta::assert_snapshot!(
        [
            told(&["report", "valve.toml", "--out", "valve.toml", "--force"]),
            told(&["report", "valve.toml", "--log", "log.csv", "--out", "./tables/../log.csv", "--force"]),
            told(&["simulate", "valve.toml", "--plot", "folder.svg", "--force"]),
            told(&["simulate", "valve.toml", "--trace", "one.svg", "--plot", "./one.svg"]),
            told(&["simulate", "valve.toml", "--trace", "nowhere/one.csv"]),
            told(&["build-tables", "valve.toml", "--out", "tables"]),
        ]
        .concat()
    );
}

#[test]
fn all_outputs_are_looked_at_before_any_is_begun() {
    let sandbox = Sandbox::with_tables();
    sandbox.write("there.svg", "mine");
    // What is refused leaves none of the others behind, whichever comes first.
    for (trace, plot) in [("new.csv", "there.svg"), ("there.svg", "new.svg")] {
        let refused = refusal(&sandbox, &["simulate", "valve.toml", "--trace", trace, "--plot", plot]);
        assert!(refused.starts_with("error: there.svg: exists already\n"), "{refused}");
    }
    assert_eq!(sandbox.read("there.svg"), "mine");
}

#[cfg(unix)]
#[test]
fn devices_and_read_only_files_stay() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let sandbox = Sandbox::new();
    symlink("/dev/null", sandbox.path("null.svg")).unwrap();
    let refused = refusal(&sandbox, &["simulate", "valve.toml", "--plot", "null.svg", "--force"]);
    assert!(refused.starts_with("error: null.svg: is no regular file and is not replaced\nhint: "), "{refused}");
    sandbox.write("kept.svg", "mine");
    fs::set_permissions(sandbox.path("kept.svg"), fs::Permissions::from_mode(0o444)).unwrap();
    let refused = refusal(&sandbox, &["simulate", "valve.toml", "--plot", "kept.svg", "--force"]);
    assert!(refused.starts_with("error: kept.svg: is read-only and is not replaced\nhint: "), "{refused}");
    // An input under another name is still an input.
    symlink("valve.toml", sandbox.path("alias.html")).unwrap();
    fs::hard_link(sandbox.path("valve.toml"), sandbox.path("hard.html")).unwrap();
    for name in ["alias.html", "hard.html"] {
        let refused = refusal(&sandbox, &["report", "valve.toml", "--out", name, "--force"]);
        assert!(refused.contains("is read by this call"), "{refused}");
    }
}

#[cfg(unix)]
#[test]
fn tables_keep_their_mode_and_are_no_links() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let sandbox = Sandbox::with_tables();
    let mode = |name: &str| fs::metadata(sandbox.path(name)).unwrap().permissions().mode() & 0o777;
    fs::set_permissions(sandbox.path("tables/supply.csv"), fs::Permissions::from_mode(0o660)).unwrap();
    let call = ["build-tables", "valve.toml", "--out", "tables", "--wear", "leaks", "--force"];
    let output = sandbox.valve(&call);
    assert_eq!(output.status.code(), Some(0), "{}", shown(&output));
    assert_eq!(mode("tables/supply.csv"), 0o660);
    fs::rename(sandbox.path("tables/supply.csv"), sandbox.path("elsewhere.csv")).unwrap();
    symlink("../elsewhere.csv", sandbox.path("tables/supply.csv")).unwrap();
    let refused = refusal(&sandbox, &call);
    assert!(refused.contains("tables/supply.csv: is a symbolic link; tables are replaced as a set"), "{refused}");
}
