//! A Markdown file between whose marks tables are rewritten.

use std::fs;
use std::path::Path;

use crate::stage::Failure;

/// Rewrites a document's tables, as [`with_tables`] says.
///
/// # Errors
/// If it cannot be read or written, or a pair of marks is missing.
pub fn rewrite(path: &Path, tables: &[(&'static str, String)]) -> Result<(), Failure> {
    let named = |error| format!("{}: {error}", path.display());
    let document = fs::read_to_string(path).map_err(named)?;
    fs::write(path, with_tables(&document, tables)?).map_err(named)?;
    Ok(())
}

/// Puts each table between the marks `<!-- begin: NAME -->` and `<!-- end: NAME -->` of its name.
///
/// # Errors
/// If a pair of marks is missing.
pub fn with_tables(document: &str, tables: &[(&'static str, String)]) -> Result<String, Failure> {
    let mut text = document.to_owned();
    for (name, table) in tables {
        let begin = format!("<!-- begin: {name} -->\n");
        let end = format!("<!-- end: {name} -->");
        let missing = || format!("the document has no table {name}");
        let first = text.find(&begin).ok_or_else(missing)? + begin.len();
        let last = first + text[first..].find(&end).ok_or_else(missing)?;
        text.replace_range(first..last, &format!("\n{}\n\n", table.trim_end()));
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_replaced_and_the_rest_is_kept() {
        let document = "a\n<!-- begin: t -->\nold\n<!-- end: t -->\nb\n";
        let once = with_tables(document, &[("t", "| x |\n".to_owned())]).unwrap();
        assert_eq!(
            once,
            "a\n<!-- begin: t -->\n\n| x |\n\n<!-- end: t -->\nb\n"
        );
        assert_eq!(
            with_tables(&once, &[("t", "| x |".to_owned())]).unwrap(),
            once
        );
        assert!(with_tables(document, &[("u", String::new())]).is_err());
    }
}
