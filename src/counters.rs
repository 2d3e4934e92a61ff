//! Counters: how a part of the stack says what it has seen, done and thrown away, one number for
//! each. Whatever is dropped is counted with its reason, so that a flood is seen and not felt.

/// Makes `Counter`, what is counted, each with a few words for people, and `Counters`, the numbers,
/// whose documentation stands first.
#[doc(hidden)]
#[macro_export]
macro_rules! counters {
    (
        $(#[doc = $numbers:literal])+
        pub struct Counters;
        $($(#[doc = $doc:literal])+ $name:ident = $text:literal,)+
    ) => {
        /// What is counted.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[non_exhaustive]
        pub enum Counter {
            $($(#[doc = $doc])+ $name,)+
        }

        impl Counter {
            /// Every counter, in the order of their listing.
            pub const ALL: &[Self] = &[$(Self::$name,)+];

            /// What is counted, in a few words.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$name => $text,)+
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
        /// `Display` lists those that are not zero, one a line.
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
            /// The number of one counter.
            #[must_use]
            pub fn get(&self, counter: Counter) -> u64 {
                self.values[counter as usize]
            }

            /// All counters with their numbers.
            pub fn iter(&self) -> impl Iterator<Item = (Counter, u64)> + '_ {
                Counter::ALL.iter().copied().zip(self.values)
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
