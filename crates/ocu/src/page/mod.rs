//! The operator's page: plain HTML, CSS and JavaScript modules, embedded in the binary.
//!
//! There is no build step, and nothing is loaded from elsewhere. So the page works on a vehicle's
//! own network without the Internet, and the browser is instructed to run nothing else.

/// One file of the page.
#[derive(Clone, Copy, Debug)]
pub(crate) struct File {
    /// URL path on the server, starting with `/`.
    pub(crate) path: &'static str,
    /// Media type for the header `Content-Type`.
    pub(crate) content_type: &'static str,
    /// Content of the file.
    pub(crate) body: &'static str,
}

/// The header `Content-Security-Policy`: the page may run its own scripts and talk to its own
/// server, nothing else. Inline styles and event handlers are blocked as well, so a name from the
/// network can never become code.
pub(crate) const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; \
    img-src 'self' data:; connect-src 'self'; manifest-src 'self'; base-uri 'none'; form-action 'none'; \
    frame-ancestors 'none'";

const HTML: &str = "text/html; charset=utf-8";
const CSS: &str = "text/css; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";

macro_rules! files {
    ($($path:literal $content_type:ident $file:literal,)*) => {
        &[$(File { path: $path, content_type: $content_type, body: include_str!($file) },)*]
    };
}

/// All files of the page.
pub(crate) const FILES: &[File] = files! {
    "/" HTML "index.html",
    "/style.css" CSS "style.css",
    "/sections.css" CSS "sections.css",
    "/alerts.css" CSS "alerts.css",
    "/start.js" SCRIPT "start.js",
    "/main.js" SCRIPT "main.js",
    "/account.js" SCRIPT "account.js",
    "/dom.js" SCRIPT "dom.js",
    "/changes.js" SCRIPT "changes.js",
    "/flow.js" SCRIPT "flow.js",
    "/link.js" SCRIPT "link.js",
    "/pass.js" SCRIPT "pass.js",
    "/stop_link.js" SCRIPT "stop_link.js",
    "/fleet.js" SCRIPT "fleet.js",
    "/handover.js" SCRIPT "handover.js",
    "/status.js" SCRIPT "status.js",
    "/map.js" SCRIPT "map.js",
    "/painter.js" SCRIPT "painter.js",
    "/raster.js" SCRIPT "raster.js",
    "/pull.js" SCRIPT "pull.js",
    "/overlay.js" SCRIPT "overlay.js",
    "/basemap.js" SCRIPT "basemap.js",
    "/mvt.js" SCRIPT "mvt.js",
    "/projection.js" SCRIPT "projection.js",
    "/mission.js" SCRIPT "mission.js",
    "/drive.js" SCRIPT "drive.js",
    "/drive_end.js" SCRIPT "drive_end.js",
    "/input.js" SCRIPT "input.js",
    "/input_events.js" SCRIPT "input_events.js",
    "/sources.js" SCRIPT "sources.js",
    "/engage.js" SCRIPT "engage.js",
    "/focus.js" SCRIPT "focus.js",
    "/gamepad.js" SCRIPT "gamepad.js",
    "/emergency.js" SCRIPT "emergency.js",
    "/stopping.js" SCRIPT "stopping.js",
    "/theme.js" SCRIPT "theme.js",
    "/alarms.js" SCRIPT "alarms.js",
    "/sound.js" SCRIPT "sound.js",
    "/tree.js" SCRIPT "tree.js",
    "/messages.js" SCRIPT "messages.js",
    "/events.js" SCRIPT "events.js",
};
