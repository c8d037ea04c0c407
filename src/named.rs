//! Enumerations whose variants have names in files.

/// Gives an enumeration without data `ALL`, `name` and `from_name`.
macro_rules! named_variants {
    ($type:ident { $($variant:ident $name:literal,)* }) => {
        impl $type {
            /// All of them.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)*];

            /// The name in files.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)* }
            }

            /// The one of that name.
            pub fn from_name(name: &str) -> Option<Self> {
                Self::ALL.iter().copied().find(|v| v.name() == name)
            }
        }
    };
}
