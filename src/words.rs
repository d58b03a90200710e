//! Options of a few values. One list for each type says how they are read, shown and explained.
//! (`strum` derives words, but neither meanings nor sentences that refuse others.)

/// Gives an enum of options the list `WORDS`, and `word`, [`FromStr`](std::str::FromStr) and
/// [`Display`](std::fmt::Display) that use it.
macro_rules! words {
    ($type:ident, $what:literal: [$(($value:ident, $word:literal, $meaning:literal)),+ $(,)?]) => {
        impl $type {
            #[doc(hidden)]
            /// Every value: its word, the value, and what it means.
            pub const WORDS: &[(&str, $type, &str)] = &[$(($word, $type::$value, $meaning)),+];

            #[doc(hidden)]
            /// The word of this value.
            pub fn word(self) -> &'static str {
                match self {
                    $($type::$value => $word),+
                }
            }
        }

        #[doc(hidden)]
        impl std::str::FromStr for $type {
            type Err = crate::error::Error;

            fn from_str(word: &str) -> crate::error::Result<Self> {
                let found = Self::WORDS.iter().find(|(known, ..)| *known == word);
                found.map(|(_, value, _)| *value).ok_or_else(|| {
                    let known: Vec<&str> = Self::WORDS.iter().map(|(word, ..)| *word).collect();
                    crate::error::Error::Argument(format!(
                        concat!("there is no ", $what, " {}: {} are possible"),
                        crate::error::quoted(word),
                        known.join(", ")
                    ))
                })
            }
        }

        #[doc(hidden)]
        impl std::fmt::Display for $type {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.pad(self.word())
            }
        }
    };
}

pub(crate) use words;

#[cfg(test)]
mod tests {
    use crate::bezier::{EndTangents, Joints, PieceLengths};
    use crate::discrete::{Pins, Solver};
    use crate::laplacian::Reproduces;
    use crate::spline::Parametrisation;
    use crate::{Error, Precision};

    #[test]
    fn every_value_is_read_from_its_word() {
        macro_rules! read_back {
            ($($type:ty),+) => {$(
                for (word, value, _) in <$type>::WORDS {
                    assert_eq!((word.parse::<$type>().unwrap(), &value.to_string()[..]), (*value, *word));
                }
            )+};
        }
        read_back!(Precision, Joints, PieceLengths, EndTangents, Solver, Pins, Reproduces, Parametrisation);
    }

    #[test]
    fn a_word_that_is_none_is_refused_with_those_that_are() {
        let Err(Error::Argument(sentence)) = "C3".parse::<Joints>() else { panic!("C3 is no word") };
        assert_eq!(sentence, "there is no kind of joint \"C3\": free, c1, c2, g1 are possible");
    }
}
