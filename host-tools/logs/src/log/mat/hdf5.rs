//! The arrays of an HDF5 file: of MATLAB's version 7.3, or of another program.

use super::{Arrays, MAX_BYTES, MAX_DEPTH};
use hdf5_reader::group::Group;
use hdf5_reader::messages::datatype::Datatype;
use hdf5_reader::{Dataset, Hdf5File, OpenOptions};

/// Adds every real numeric array.
pub(super) fn read(bytes: Vec<u8>, arrays: &mut Arrays) -> Result<(), String> {
    let limit = MAX_BYTES as usize;
    let options = OpenOptions::default().with_max_read_bytes(limit).with_max_chunk_bytes(limit);
    let file = Hdf5File::from_vec_with_options(bytes, options).map_err(|error| format!("no HDF5 file: {error}"))?;
    let root = file.root_group().map_err(|error| format!("no HDF5 file: {error}"))?;
    // numbers come in this machine's order
    arrays.is_big_endian = cfg!(target_endian = "big");
    group("", &root, arrays, 0);
    Ok(())
}

/// What is in a group; it is a structure's, its name a path.
fn group(path: &str, group: &Group, arrays: &mut Arrays, depth: usize) {
    // MATLAB keeps what its cells and objects refer to in groups named `#refs#`, `#subsystem#`
    let Some((groups, datasets)) = group.members().ok().filter(|_| depth <= MAX_DEPTH) else { return };
    for dataset in datasets {
        let name = format!("{path}{}", dataset.name());
        match array(&dataset, arrays) {
            Some((size, values)) => arrays.add(name, size, &values),
            None => arrays.other.push(name),
        }
    }
    for inner in groups.iter().filter(|inner| !inner.name().starts_with('#')) {
        if inner.attribute("MATLAB_sparse").is_ok() {
            arrays.other.push(format!("{path}{}", inner.name()));
            continue;
        }
        self::group(&format!("{path}{}.", inner.name()), inner, arrays, depth + 1);
    }
}

/// Rows and columns as MATLAB counts them, and the numbers column by column.
fn array(dataset: &Dataset, arrays: &mut Arrays) -> Option<([usize; 2], Vec<f64>)> {
    let is_text = dataset.attribute("MATLAB_class").is_ok_and(|class| class.raw_data.starts_with(b"char"));
    let is_empty = dataset.attribute("MATLAB_empty").is_ok();
    let kind = mat_type(dataset.dtype()).filter(|_| !is_text && !is_empty)?;
    let size = match *dataset.shape() {
        [rows] => [rows, 1],
        [columns, rows] => [rows, columns],
        _ => return None,
    };
    let length = dataset.raw_byte_len().ok().filter(|length| *length as u64 <= arrays.left)?;
    arrays.left -= length as u64;
    let values = arrays.numbers(kind, &dataset.read_native_bytes().ok()?)?;
    Some((size.map(|n| n as usize), values))
}

/// The type of a MAT-file's element that holds such numbers.
fn mat_type(datatype: &Datatype) -> Option<u32> {
    match datatype {
        Datatype::FixedPoint { size: 1, signed, .. } => Some(if *signed { 1 } else { 2 }),
        Datatype::FixedPoint { size: 2, signed, .. } => Some(if *signed { 3 } else { 4 }),
        Datatype::FixedPoint { size: 4, signed, .. } => Some(if *signed { 5 } else { 6 }),
        Datatype::FixedPoint { size: 8, signed, .. } => Some(if *signed { 12 } else { 13 }),
        Datatype::FloatingPoint { size: 4, .. } => Some(7),
        Datatype::FloatingPoint { size: 8, .. } => Some(9),
        _ => None,
    }
}
