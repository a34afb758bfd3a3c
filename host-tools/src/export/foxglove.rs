//! `--foxglove`: an MCAP file of well-known schemas, and a layout beside it.

use crate::foxglove::{LAYOUT, Sink, Topics};
use anyhow::Context;
use backseat_logs::output::{Existing, check, write};
use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// The file under way.
pub struct McapFile {
    path: PathBuf,
    layout: PathBuf,
    mcap: mcap::Writer<BufWriter<File>>,
}

/// What was written.
pub struct Written {
    pub path: PathBuf,
    pub layout: PathBuf,
    pub messages: u64,
}

/// Begins the file; `utc_offset_us` is UTC at the log's time zero, 0 where it is not known.
pub fn create(path: &Path, force: bool, utc_offset_us: i64) -> anyhow::Result<Topics<McapFile>> {
    let layout = path.with_extension("layout.json");
    let existing = if force { Existing::Replace } else { Existing::Keep };
    check(path, existing)?;
    write(&layout, existing, |file| file.write_all(LAYOUT.as_bytes()))?;
    let file = File::create(path).with_context(|| path.display().to_string())?;
    let options = WriteOptions::new()
        .library(concat!("backseat ", env!("CARGO_PKG_VERSION")))
        .compression(Some(Compression::Lz4));
    let mcap = options.create(BufWriter::new(file)).with_context(|| path.display().to_string())?;
    Ok(Topics::new(McapFile { path: path.to_owned(), layout, mcap }, utc_offset_us))
}

/// Ends the file.
pub fn finish(topics: Topics<McapFile>) -> anyhow::Result<Written> {
    let (McapFile { path, layout, mut mcap }, messages) = topics.finish()?;
    let place = || path.display().to_string();
    mcap.finish().with_context(place)?;
    mcap.into_inner().flush().with_context(place)?;
    Ok(Written { path, layout, messages })
}

impl Sink for McapFile {
    fn channel(&mut self, topic: &str, schema: &str, json_schema: &[u8]) -> anyhow::Result<u16> {
        let schema = self.mcap.add_schema(schema, "jsonschema", json_schema)?;
        Ok(self.mcap.add_channel(schema, topic, "json", &BTreeMap::new())?)
    }

    fn message(&mut self, channel_id: u16, time_ns: u64, json: &[u8]) -> anyhow::Result<()> {
        let header = MessageHeader { channel_id, sequence: 0, log_time: time_ns, publish_time: time_ns };
        self.mcap.write_to_known_channel(&header, json).with_context(|| self.path.display().to_string())
    }
}
