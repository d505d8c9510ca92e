//! What the tests need of a page: its examples, links, pictures and headings.
//!
//! Never changes a page.

use pulldown_cmark::{CodeBlockKind, Event, Options, Parser, Tag, TagEnd};
use std::{collections::BTreeMap, ops::Range};

/// A fenced block.
pub(super) struct Block {
    /// What stands behind the opening fence: `console`, `toml file=my.toml`.
    pub(super) info: String,
    pub(super) text: String,
    /// Where the text stands in the page.
    pub(super) place: Range<usize>,
}

/// A link or a picture.
pub(super) struct Link {
    pub(super) target: String,
    /// The title in quotes behind the target; empty without one.
    pub(super) title: String,
    pub(super) is_picture: bool,
}

/// The parts of a page that tests look at.
#[derive(Default)]
pub(super) struct Page {
    pub(super) blocks: Vec<Block>,
    pub(super) links: Vec<Link>,
    /// The names by which links find its headings.
    pub(super) anchors: Vec<String>,
}

impl Page {
    pub(super) fn parse(text: &str) -> Self {
        let mut page = Self::default();
        let mut heading: Option<String> = None;
        let mut seen = BTreeMap::new();
        for (event, place) in Parser::new_ext(text, Options::ENABLE_TABLES).into_offset_iter() {
            match event {
                Event::Start(Tag::CodeBlock(CodeBlockKind::Fenced(info))) => {
                    let place = place.start..place.start;
                    page.blocks.push(Block { info: info.to_string(), text: String::new(), place });
                }
                Event::Text(part) => page.take_text(&part, place, heading.as_mut()),
                // Code counts for the name of a heading; elsewhere no test looks at it.
                Event::Code(part) => heading.iter_mut().for_each(|heading| heading.push_str(&part)),
                Event::Start(Tag::Link { dest_url, title, .. }) => page.take_link(&dest_url, &title, false),
                Event::Start(Tag::Image { dest_url, title, .. }) => page.take_link(&dest_url, &title, true),
                Event::Start(Tag::Heading { .. }) => heading = Some(String::new()),
                Event::End(TagEnd::Heading(_)) => {
                    page.anchors.extend(heading.take().map(|heading| anchor(&heading, &mut seen)));
                }
                _ => {}
            }
        }
        page
    }

    /// A block ends with its last text, so text belongs to the block that has just begun, or to a heading.
    fn take_text(&mut self, part: &str, place: Range<usize>, heading: Option<&mut String>) {
        match (heading, self.blocks.last_mut()) {
            (Some(heading), _) => heading.push_str(part),
            (None, Some(block)) if block.is_followed_by(&place) => {
                block.text.push_str(part);
                let start = if block.place.is_empty() { place.start } else { block.place.start };
                block.place = start..place.end;
            }
            _ => {}
        }
    }

    fn take_link(&mut self, target: &str, title: &str, is_picture: bool) {
        self.links.push(Link { target: target.into(), title: title.into(), is_picture });
    }
}

impl Block {
    /// Whether text at `place` is the first of the block, right behind its fence, or goes on with it.
    fn is_followed_by(&self, place: &Range<usize>) -> bool {
        let fence = "```\n".len() + self.info.len();
        place.start == self.place.end || (self.place.is_empty() && place.start <= self.place.start + fence)
    }
}

/// The name of a heading, as GitHub and mdBook make it; a second heading of that name gets a number.
fn anchor(heading: &str, seen: &mut BTreeMap<String, usize>) -> String {
    let kept = |c: &char| c.is_alphanumeric() || " -_".contains(*c);
    let name: String = heading.trim().to_lowercase().chars().filter(kept).collect();
    let name = name.replace(' ', "-");
    let count = seen.entry(name.clone()).or_insert(0);
    *count += 1;
    if *count == 1 { name } else { format!("{name}-{}", *count - 1) }
}

#[test]
fn a_page_has_blocks_with_their_places_links_and_anchors() {
    let text = "# One `two`, 3\n\n[a](b.md#c \"t\") ![p](q.svg)\n\n```console\n$ x\n\ny\n```\n\ntext\n\n## One two 3\n";
    let page = Page::parse(text);
    assert_eq!((page.blocks[0].info.as_str(), page.blocks[0].text.as_str()), ("console", "$ x\n\ny\n"));
    assert_eq!(&text[page.blocks[0].place.clone()], "$ x\n\ny\n");
    let links: Vec<_> = page.links.iter().map(|link| (link.target.as_str(), link.is_picture)).collect();
    assert_eq!((links, page.links[0].title.as_str()), (vec![("b.md#c", false), ("q.svg", true)], "t"));
    assert_eq!(page.anchors, ["one-two-3", "one-two-3-1"]);
}
