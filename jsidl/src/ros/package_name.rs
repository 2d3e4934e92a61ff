//! The name of a ROS 2 package.

use std::fmt;
use std::str::FromStr;

use crate::typed::keywords;

/// A valid name of a ROS 2 package: lower-case letters, digits and single underscores, beginning
/// with a letter, and no keyword of C++ or Python.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PackageName(String);

/// The name is none of a ROS 2 package.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "a package name consists of at least two lower-case letters, digits and single underscores, begins with a \
     letter, does not end with an underscore and is no keyword, for example jaus_msgs"
)]
pub struct PackageNameError;

impl Default for PackageName {
    /// `jaus_msgs`
    fn default() -> Self {
        Self("jaus_msgs".to_owned())
    }
}

impl FromStr for PackageName {
    type Err = PackageNameError;

    fn from_str(name: &str) -> Result<Self, PackageNameError> {
        let is_letter = |c: char| c.is_ascii_lowercase();
        let is_valid = |c| is_letter(c) || c.is_ascii_digit() || c == '_';
        let is_keyword = [keywords::CPP, keywords::PYTHON]
            .iter()
            .any(|words| words.contains(&name));
        let is_separated = !name.ends_with('_') && !name.contains("__");
        if name.len() > 1
            && name.starts_with(is_letter)
            && name.chars().all(is_valid)
            && is_separated
            && !is_keyword
        {
            Ok(Self(name.to_owned()))
        } else {
            Err(PackageNameError)
        }
    }
}

impl fmt::Display for PackageName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_package_name_follows_the_rules_of_ros() {
        for name in ["jaus_msgs", "a1", "my_robot_2_msgs"] {
            assert_eq!(name.parse(), Ok(PackageName(name.to_owned())), "{name}");
        }
        for name in [
            "",
            "a",
            "Jaus",
            "1jaus",
            "jaus__msgs",
            "jaus_",
            "_jaus",
            "jaus-msgs",
            "jäus",
            "class",
            "lambda",
            "../x",
        ] {
            assert_eq!(name.parse::<PackageName>(), Err(PackageNameError), "{name}");
        }
    }
}
