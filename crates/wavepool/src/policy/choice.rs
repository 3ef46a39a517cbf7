//! What can be chosen by name: the one list behind `--schedule`, its messages and its explanations.
//!
//! **Invariant:** a policy of the library stands in the list of its trait, beside its implementation, and nowhere else by name.

/// Something that a schedule can name.
#[derive(Debug)]
pub struct Choice<T: 'static> {
    /// One word, as in `--schedule`.
    pub name: &'static str,
    /// What it does, in a line.
    pub about: &'static str,
    /// Makes it.
    pub make: fn() -> T,
}

impl<T> Choice<T> {
    /// The choice of that name.
    pub fn find(choices: &[Choice<T>], name: &str) -> Option<T> {
        choices.iter().find(|choice| choice.name == name).map(|choice| (choice.make)())
    }

    /// All names, separated by commas.
    pub fn names(choices: &[Choice<T>]) -> String {
        choices.iter().map(|choice| choice.name).collect::<Vec<_>>().join(", ")
    }
}
