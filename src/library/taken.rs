//! Names that must differ, of files and identifiers.

use std::collections::{BTreeMap, BTreeSet};

/// The names that were given, whatever the case of their letters: not every file system tells cases apart.
#[derive(Clone, Debug, Default)]
pub struct TakenNames {
    taken: BTreeSet<String>,
    /// Where to go on counting, by name: a thousand equal names must not take a million steps.
    next: BTreeMap<String, usize>,
}

impl TakenNames {
    /// `name`, or where it is taken what `numbered` makes of the first number from 2 that leads to a free one.
    pub fn take(&mut self, name: String, numbered: impl Fn(usize) -> String) -> String {
        let key = name.to_lowercase();
        if self.taken.insert(key.clone()) {
            return name;
        }
        let number = self.next.entry(key).or_insert(2);
        loop {
            let candidate = numbered(*number);
            *number += 1;
            if self.taken.insert(candidate.to_lowercase()) {
                return candidate;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_names_are_numbered_without_trying_each_number_again() {
        let mut names = TakenNames::default();
        let tried = std::cell::Cell::new(0);
        let mut take = |name: &str| {
            names.take(name.to_owned(), |number| {
                tried.set(tried.get() + 1);
                format!("{name}-{number}")
            })
        };
        assert_eq!(["a-3", "a", "A", "a", "a"].map(&mut take), ["a-3", "a", "A-2", "a-4", "a-5"]);
        for _ in 0..1000 {
            take("a");
        }
        assert!(tried.get() < 1010, "{}", tried.get());
    }
}
