//! Counters with names, by which a part of the stack reports what it received, sent and dropped.
//! Every drop is counted with its reason, so that a flood shows up in the numbers.

/// The value of a counter, with its name and description, for reports and metrics.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Count {
    /// An identifier in upper camel case, unique among the counters of its part:
    /// `SessionsEstablished`.
    pub name: &'static str,
    /// What it counts: `sessions established`. Counters of the same events that differ in their
    /// reason say so by a colon: `dropped: malformed`.
    pub description: &'static str,
    /// The number so far. It only grows.
    pub value: u64,
}

/// Defines the enum `Counter`, with a short description of each counter, and the struct `Counters`
/// with the values. The documentation of `Counters` comes first. A counter without documentation of
/// its own has its description.
#[doc(hidden)]
#[macro_export]
macro_rules! counters {
    (@doc $text:literal) => {
        concat!($text, ".")
    };
    (@doc $text:literal $(, $doc:literal)+) => {
        concat!($($doc, "\n",)+)
    };
    (
        $(#[doc = $numbers:literal])+
        pub struct Counters;
        $($(#[doc = $doc:literal])* $name:ident = $text:literal,)+
    ) => {
        /// The counters.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[non_exhaustive]
        pub enum Counter {
            $(#[doc = $crate::counters!(@doc $text $(, $doc)*)] $name,)+
        }

        impl Counter {
            /// Every counter, in order of declaration.
            pub const ALL: &[Self] = &[$(Self::$name,)+];

            /// A short description.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$name => $text,)+
                }
            }

            const fn identifier(self) -> &'static str {
                match self {
                    $(Self::$name => stringify!($name),)+
                }
            }
        }

        impl std::fmt::Display for Counter {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.pad(self.name())
            }
        }

        $(#[doc = $numbers])+
        ///
        /// `Display` lists the counters that are not zero, one per line.
        #[derive(Clone, Debug, PartialEq, Eq)]
        pub struct Counters {
            values: [u64; Counter::ALL.len()],
        }

        impl Default for Counters {
            fn default() -> Self {
                Self {
                    values: [0; Counter::ALL.len()],
                }
            }
        }

        impl Counters {
            /// The value of one counter.
            #[must_use]
            pub fn get(&self, counter: Counter) -> u64 {
                self.values[counter as usize]
            }

            /// All counters with their values.
            pub fn iter(&self) -> impl Iterator<Item = (Counter, u64)> + '_ {
                Counter::ALL.iter().copied().zip(self.values)
            }

            /// The same with names and descriptions, for reports and metrics.
            pub fn counts(&self) -> impl Iterator<Item = $crate::counters::Count> + '_ {
                self.iter().map(|(counter, value)| $crate::counters::Count {
                    name: counter.identifier(),
                    description: counter.name(),
                    value,
                })
            }

            pub(super) fn add(&mut self, counter: Counter) {
                self.add_many(counter, 1);
            }

            pub(super) fn add_many(&mut self, counter: Counter, number: u64) {
                self.values[counter as usize] += number;
            }
        }

        impl std::fmt::Display for Counters {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                for (counter, number) in self.iter().filter(|&(_, number)| number != 0) {
                    writeln!(f, "{number:>10}  {}", counter.name())?;
                }
                Ok(())
            }
        }
    };
}

pub(crate) use counters;
