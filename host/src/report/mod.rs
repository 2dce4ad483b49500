//! Reports to look at: one HTML file that needs nothing else, neither network nor other files.
//!
//! A content security policy in the page's head forbids it to load anything from elsewhere. Whatever comes from
//! files or the command line is escaped (`html::escape`).

mod columns;
pub mod completion;
pub mod evaluation;
mod histogram;
mod html;
mod page;
mod scene;
mod table;

pub use completion::Subject;
pub use page::MARK;

/// The command line of this process, quoted so that a POSIX shell takes it as it was.
pub fn command_line() -> String {
    let mut words: Vec<String> =
        std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect();
    if let Some(first) = words.first_mut() {
        *first = "lacuna".into();
    }
    words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ")
}

fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,:+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.into();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use super::quoted;

    #[test]
    fn a_shell_takes_the_words_as_they_were() {
        assert_eq!(quoted("scans/a-1.ply"), "scans/a-1.ply");
        assert_eq!(quoted("my scan"), "'my scan'");
        assert_eq!(quoted("it's"), r"'it'\''s'");
        assert_eq!(quoted(""), "''");
        assert_eq!(quoted("$(x)"), "'$(x)'");
    }
}
