//! Topics of channels: the source's id, then the name of the message.

/// `/jaus/101/1/40/ReportLocalPose`: slashes instead of points, which viewers take for fields.
pub(crate) fn topic(source: &str, name: &str) -> String {
    format!("/jaus/{}/{name}", source.replace('.', "/"))
}
