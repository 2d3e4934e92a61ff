//! Documentation of services: linked pages in HTML or Markdown, generated from definitions.
//!
//! [`pages`] generates an index, by set and by message code, and a page per service with its
//! inheritance, its messages with their wire layout, and its state machines. The HTML needs only
//! its own files; the search on the index is the only script.
//!
//! ```
//! use jsidl::docs::{Format, pages};
//!
//! let mut loader = jsidl::Loader::new();
//! loader.catalogue();
//! let library = loader.load().library;
//! let pages = pages(&library, |service| service.name == "Discovery", Format::Html);
//! assert_eq!(pages[0].path, "index.html");
//! assert!(pages.iter().any(|page| page.path == "core.Discovery.1.1.html"));
//! ```

mod block;
mod html;
mod index;
mod layout;
mod machine;
mod markdown;
pub(crate) mod names;
mod plain;
mod service;
mod values;

use std::collections::BTreeSet;

use crate::library::Library;
use crate::model::Service;
pub use plain::{LayoutRow, layout_rows};

/// Output format of pages.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Format {
    /// HTML 5, style included.
    #[default]
    Html,
    /// Markdown with tables, for code hosts and other generators.
    Markdown,
}

/// A file of the documentation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Page {
    /// File name, without directories.
    pub path: String,
    /// Its content.
    pub text: String,
}

/// The pages of the selected services and of their bases; the index first.
pub fn pages(
    library: &Library,
    mut wanted: impl FnMut(&Service) -> bool,
    format: Format,
) -> Vec<Page> {
    let wanted = library.services().filter(|service| wanted(service));
    let ids: BTreeSet<_> = wanted
        .flat_map(|service| library.lineage(service))
        .map(|service| &service.id)
        .collect();
    let services: Vec<&Service> = library
        .services()
        .map(AsRef::as_ref)
        .filter(|service| ids.contains(&service.id))
        .collect();
    let names = names::Names::new(services.iter().copied());
    let index = std::iter::once(index::page(&names, &services));
    let pages = services
        .iter()
        .map(|service| service::page(library, &names, service));
    index
        .chain(pages)
        .map(|page| written(&page, format))
        .collect()
}

fn written(page: &block::Page, format: Format) -> Page {
    match format {
        Format::Html => Page {
            path: format!("{}.html", page.name),
            text: html::page(page),
        },
        Format::Markdown => Page {
            path: format!("{}.md", page.name),
            text: markdown::page(page),
        },
    }
}
