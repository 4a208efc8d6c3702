//! What the program prints, command by command: the files of `cmd/`.
//!
//! `TRYCMD=overwrite cargo test -p servowire --test all cmd::` writes them anew; read the difference before you commit it.

#[test]
fn the_readme_shows_what_is_printed() {
    trycmd::TestCases::new().case("README.md");
}

#[test]
fn the_commands_print_what_the_files_show() {
    trycmd::TestCases::new().case("tests/cmd/*.md");
}
