//! The path of a reading by sound, and what a turn of an array does to a fix.

/// The acoustic path of a reading, from the other end to the vehicle.
#[derive(Clone, Copy, Debug, Default)]
pub struct PathAt {
    /// Unit vector in body axes.
    pub body: [f64; 3],
    /// Unit vector, north, east, down; of a USBL the measured one.
    pub ned: [f64; 3],
    /// The fixed transponder at the other end.
    pub station: Option<u32>,
}

/// A turn about the vertical, in the triad of a direction: along it, across it to the right, across it downwards
/// (Rodrigues' formula; the vertical has no part to the right).
pub fn turned_about_down(by_rad: f64, along: [f64; 3]) -> [[f64; 3]; 3] {
    let (sin, cos) = by_rad.sin_cos();
    let k = [along[2], 0.0, along[0].hypot(along[1])];
    let cross = [[0.0, -k[2], k[1]], [k[2], 0.0, -k[0]], [-k[1], k[0], 0.0]];
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let same = if i == j { cos } else { 0.0 };
            same + sin * cross[i][j] + (1.0 - cos) * k[i] * k[j]
        })
    })
}
