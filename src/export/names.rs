//! Names that other formats take: identifiers, each once.

use std::collections::BTreeSet;

/// Identifiers for the names of a scene.
#[derive(Debug, Default)]
pub(super) struct Identifiers {
    taken: BTreeSet<String>,
}

impl Identifiers {
    /// `name` with letters, digits and underscores alone, not beginning with a digit, and a number behind where it is taken.
    pub(super) fn of(&mut self, name: &str) -> String {
        let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
        let mut identifier: String = name.chars().map(plain).collect();
        if identifier.is_empty() || identifier.starts_with(|c: char| c.is_ascii_digit()) {
            identifier.insert(0, '_');
        }
        let mut candidate = identifier.clone();
        let mut again = 2;
        while !self.taken.insert(candidate.clone()) {
            candidate = format!("{identifier}_{again}");
            again += 1;
        }
        candidate
    }
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
