//! Names that other formats take: identifiers, each once.

use crate::library::TakenNames;

/// Identifiers for the names of a scene.
#[derive(Debug, Default)]
pub(super) struct Identifiers {
    taken: TakenNames,
}

impl Identifiers {
    /// `name` with letters, digits and underscores alone, not beginning with a digit, and a number behind where it is taken.
    pub(super) fn of(&mut self, name: &str) -> String {
        let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
        let mut identifier: String = name.chars().map(plain).collect();
        if identifier.is_empty() || identifier.starts_with(|c: char| c.is_ascii_digit()) {
            identifier.insert(0, '_');
        }
        self.taken.take(identifier.clone(), |number| format!("{identifier}_{number}"))
    }
}

/// What of a name becomes a file's: not every file system tells cases apart or takes any length.
pub(super) fn file_stem(name: &str) -> String {
    name.to_lowercase().chars().take(100).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_becomes_an_identifier_of_its_own() {
        let mut names = Identifiers::default();
        let all: Vec<String> = ["Metal.001", "Metal 001", "1st", "", "é"].map(|n| names.of(n)).into();
        assert_eq!(all, ["Metal_001", "Metal_001_2", "_1st", "_", "__2"]);
    }
}
