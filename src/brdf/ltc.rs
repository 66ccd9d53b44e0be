//! The table of linearly transformed cosines and its look-up. WGSL twin: `shaders/ltc.wgsl`.
//!
//! Symbols, in the shading frame (z = normal, x = tangential part of the view direction):
//!
//! | symbol | meaning |
//! |---|---|
//! | v, θ | view direction (sin θ, 0, cos θ) |
//! | r | mirror direction (−sin θ, 0, cos θ): the lobe leans to −x |
//! | M | shading frame from cosine space: D(ω) = D_o(M⁻¹ω/\|M⁻¹ω\|)·det M⁻¹/\|M⁻¹ω\|³, D_o = max(z, 0)/π |
//! | c, s | cos θ, sin θ |
//!
//! Heitz, Dupuy, Hill, Neubelt, *Real-Time Polygonal-Light Shading with Linearly Transformed Cosines*, SIGGRAPH 2016.
//! The published matrix pins the lobe's own horizon to its mean direction; here all four degrees of freedom of a
//! lobe that is symmetric about the plane of incidence are fitted. What is stored is M up to a factor, with the lobe's
//! axis seen from the mirror direction and with α taken out, so that it is finite and smooth down to a mirror and
//! out to grazing view, and so that the reflection is where the mirror puts it whatever lies between two nodes:
//!
//! ```text
//!     ⎡ α·ux  0     tx ⎤
//! M = ⎢ 0     α·β²  0  ⎥     (tx, tz) = α·τx·(c, s) + τz·(−s, c)
//!     ⎣ α·uz  0     tz ⎦
//! ```

use crate::kernel::lanes::{Real, Vector};
use glam::{Mat3, Vec3, Vec4};
use std::sync::LazyLock;

/// Smallest α of the table; [`Table::lobe`] clamps to it.
pub const ALPHA_MIN: f32 = 1e-4;

/// Most nodes along either axis.
pub const MAX_NODES: usize = 1024;

const MAGIC: [u8; 8] = *b"GLYPHLTC";
const VERSION: u32 = 1;
const HEADER_BYTES: usize = 48;
const CHANNELS: usize = 7;

/// M⁻¹ times a positive factor: the density of a linearly transformed cosine doesn't depend on that factor.
///
/// Mirror symmetry about the plane of incidence leaves five entries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InverseMatrix<T = f32> {
    /// Row x, column x.
    pub xx: T,
    /// Row x, column z.
    pub xz: T,
    /// Row y, column y.
    pub yy: T,
    /// Row z, column x.
    pub zx: T,
    /// Row z, column z.
    pub zz: T,
}

impl<T: Real> InverseMatrix<T> {
    /// M⁻¹·w: shading frame to cosine space.
    #[inline(always)]
    pub fn apply<V: Vector<T>>(&self, w: V) -> V {
        V::of(self.xx * w.x() + self.xz * w.z(), self.yy * w.y(), self.zx * w.x() + self.zz * w.z())
    }
}

impl InverseMatrix {
    /// The same in f64.
    pub fn widen(&self) -> InverseMatrix<f64> {
        let [xx, xz, yy, zx, zz] = [self.xx, self.xz, self.yy, self.zx, self.zz].map(f64::from);
        InverseMatrix { xx, xz, yy, zx, zz }
    }

    /// The determinant; more than 0.
    #[inline]
    pub fn determinant(&self) -> f32 {
        self.yy * (self.xx * self.zz - self.xz * self.zx)
    }

    /// The full matrix.
    pub fn mat3(&self) -> Mat3 {
        Mat3::from_cols_array(&[self.xx, 0.0, self.zx, 0.0, self.yy, 0.0, self.xz, 0.0, self.zz])
    }
}

/// One linearly transformed cosine, ready for integration.
///
/// The reflected radiance of a light is `radiance · E · albedo / above`, where E is the integral of the clamped cosine
/// over the light as it stands in cosine space, clipped at both horizons (z > 0 and `m_row_z`·p > 0), and albedo =
/// F0·(magnitude − fresnel) + F90·fresnel. Where the second clip is left out, so is `above`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lobe {
    /// M⁻¹ up to a positive factor.
    pub m_inv: InverseMatrix,
    /// Third row of M up to a positive factor: the true surface's normal as a covector of cosine space; y is 0.
    pub m_row_z: Vec3,
    /// Directional albedo with Fresnel = 1.
    pub magnitude: f32,
    /// The part of the albedo weighted by (1 − v·h)⁵.
    pub fresnel: f32,
    /// 1 − the lobe's mass below the true horizon, (½, 1].
    pub above: f32,
    /// GGX width it was looked up at.
    pub alpha: f32,
    /// cos θ of the view it was looked up at.
    pub cos_theta: f32,
}

impl Lobe {
    /// The lobe as the published techniques use it: clipped at z = 0 of cosine space only.
    #[must_use]
    pub const fn with_one_horizon(self) -> Self {
        Self { m_row_z: Vec3::Z, above: 1.0, ..self }
    }
}

/// What is stored at a node, and what [`Table::lobe`] interpolates: see the head of this file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Entry {
    /// First column of M, x, divided by α; (ux, uz) is a unit vector, square to the normal of the lobe's horizon.
    pub ux: f32,
    /// First column of M, z, divided by α.
    pub uz: f32,
    /// Root of the y entry of M divided by α: 1 for a round lobe.
    pub beta: f32,
    /// Third column of M, the lobe's axis: its part square to the mirror direction, divided by α.
    pub tau_x: f32,
    /// Its part along the mirror direction: ½ for a mirror at normal view.
    pub tau_z: f32,
    /// Directional albedo with Fresnel = 1.
    pub magnitude: f32,
    /// The part of the albedo weighted by (1 − v·h)⁵.
    pub fresnel: f32,
}

impl Entry {
    fn to_channels(self) -> [f32; CHANNELS] {
        [self.ux, self.uz, self.beta, self.tau_x, self.tau_z, self.magnitude, self.fresnel]
    }

    fn from_channels([ux, uz, beta, tau_x, tau_z, magnitude, fresnel]: [f32; CHANNELS]) -> Self {
        Self { ux, uz, beta, tau_x, tau_z, magnitude, fresnel }
    }
}

/// Why bytes are not a table.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum TableError {
    /// Not a table, or of another version.
    #[error("not an LTC table of version {VERSION}: the head reads {0:02x?}")]
    Magic(Vec<u8>),
    /// Fewer or more bytes than the head promises.
    #[error("LTC table of {alphas} × {thetas} entries: {found} bytes instead of {expected}")]
    Length {
        /// Rows (α) by the head.
        alphas: usize,
        /// Columns (θ) by the head.
        thetas: usize,
        /// Bytes needed.
        expected: usize,
        /// Bytes given.
        found: usize,
    },
    /// The bytes changed since they were written.
    #[error("LTC table: checksum {found:#010x} instead of {expected:#010x}")]
    Checksum {
        /// By the head.
        expected: u32,
        /// Of the entries.
        found: u32,
    },
    /// Sizes that no fit makes, or another α axis.
    #[error(
        "LTC table: {alphas} × {thetas} entries from alpha {alpha_min}: must be 2 to {MAX_NODES} each way, from {ALPHA_MIN}"
    )]
    Axes {
        /// Rows (α).
        alphas: usize,
        /// Columns (θ).
        thetas: usize,
        /// First α.
        alpha_min: f32,
    },
    /// An entry that is no lobe.
    #[error("LTC table: entry {row}, {column} is not a finite lobe of positive width")]
    Entry {
        /// Index along α.
        row: usize,
        /// Index along θ.
        column: usize,
    },
}

/// How a table was fitted, kept in its head.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Provenance {
    /// Visible normals of the error sum: rings and azimuths of half a turn.
    pub normals: [u32; 2],
    /// Plain directions of the error sum: heights and azimuths of half a turn.
    pub directions: [u32; 2],
    /// Whether the tilt of the lobe's horizon was fitted, not pinned to the mean direction.
    pub free_tilt: bool,
}

/// Lobes over (√α, √(1 − cos θ)), both axes in equal steps: α from [`ALPHA_MIN`] to 1, θ from 0 to 90°.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    alphas: usize,
    thetas: usize,
    provenance: Provenance,
    /// √α of the first row, and rows per √α.
    first: f32,
    steps: f32,
    /// Rows of equal α: ux, uz, β, τx | τz, magnitude, fresnel, 0.
    texels: Vec<[Vec4; 2]>,
}

impl Table {
    /// The table that ships with the crate, made by `glyphlight fit` (see `src/brdf/ltc_table.md`).
    pub fn shipped() -> &'static Self {
        static SHIPPED: LazyLock<Table> = LazyLock::new(|| {
            Table::parse(include_bytes!("ltc_table.bin")).expect("the built-in LTC table is checked by the test suite")
        });
        &SHIPPED
    }

    /// A table from its entries, rows of equal α.
    ///
    /// # Errors
    /// [`TableError::Axes`], [`TableError::Length`] or [`TableError::Entry`].
    pub fn new(alphas: usize, thetas: usize, provenance: Provenance, entries: &[Entry]) -> Result<Self, TableError> {
        check_axes(alphas, thetas, ALPHA_MIN)?;
        if entries.len() != alphas * thetas {
            let (expected, found) = (alphas * thetas * CHANNELS * 4, entries.len() * CHANNELS * 4);
            return Err(TableError::Length { alphas, thetas, expected, found });
        }
        for (k, e) in entries.iter().enumerate() {
            let sound =
                e.to_channels().iter().all(|v| v.is_finite()) && e.ux > 0.0 && e.beta > 0.0 && e.magnitude > 0.0;
            if !sound {
                return Err(TableError::Entry { row: k / thetas, column: k % thetas });
            }
        }
        let texel =
            |e: &Entry| [Vec4::new(e.ux, e.uz, e.beta, e.tau_x), Vec4::new(e.tau_z, e.magnitude, e.fresnel, 0.0)];
        let first = ALPHA_MIN.sqrt();
        let steps = (alphas - 1) as f32 / (1.0 - first);
        Ok(Self { alphas, thetas, provenance, first, steps, texels: entries.iter().map(texel).collect() })
    }

    /// Reads what [`Table::to_bytes`] wrote.
    ///
    /// # Errors
    /// Any [`TableError`].
    pub fn parse(bytes: &[u8]) -> Result<Self, TableError> {
        let u32_at = |at: usize| u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
        if bytes.len() < HEADER_BYTES || bytes[..8] != MAGIC || u32_at(8) != VERSION {
            return Err(TableError::Magic(bytes[..bytes.len().min(12)].to_vec()));
        }
        let (alphas, thetas) = (u32_at(12) as usize, u32_at(16) as usize);
        check_axes(alphas, thetas, f32::from_bits(u32_at(20)))?;
        let expected = HEADER_BYTES + alphas * thetas * CHANNELS * 4;
        if bytes.len() != expected {
            return Err(TableError::Length { alphas, thetas, expected, found: bytes.len() });
        }
        let provenance = Provenance {
            normals: [u32_at(24), u32_at(28)],
            directions: [u32_at(32), u32_at(36)],
            free_tilt: u32_at(40) == 1,
        };
        let (expected, found) = (u32_at(44), fnv1a(&bytes[HEADER_BYTES..]));
        if expected != found {
            return Err(TableError::Checksum { expected, found });
        }
        let entry = |k: usize| {
            Entry::from_channels(std::array::from_fn(|c| f32::from_bits(u32_at(HEADER_BYTES + (k * CHANNELS + c) * 4))))
        };
        Self::new(alphas, thetas, provenance, &(0..alphas * thetas).map(entry).collect::<Vec<_>>())
    }

    /// The table as bytes, little-endian: magic, version, sizes, first α, provenance, FNV-1a of the rest, entries.
    pub fn to_bytes(&self) -> Vec<u8> {
        let body: Vec<u8> =
            (0..self.texels.len()).flat_map(|k| self.entry_at(k).to_channels()).flat_map(f32::to_le_bytes).collect();
        let p = &self.provenance;
        let head = [
            VERSION,
            self.alphas as u32,
            self.thetas as u32,
            ALPHA_MIN.to_bits(),
            p.normals[0],
            p.normals[1],
            p.directions[0],
            p.directions[1],
            u32::from(p.free_tilt),
            fnv1a(&body),
        ];
        let mut bytes = MAGIC.to_vec();
        bytes.extend(head.iter().flat_map(|v| v.to_le_bytes()));
        bytes.extend(body);
        bytes
    }

    /// Number of nodes along α and along θ.
    pub const fn size(&self) -> [usize; 2] {
        [self.alphas, self.thetas]
    }

    /// How the table was fitted.
    pub const fn provenance(&self) -> Provenance {
        self.provenance
    }

    /// The entry at a node.
    pub fn entry(&self, row: usize, column: usize) -> Entry {
        self.entry_at(row * self.thetas + column)
    }

    fn entry_at(&self, k: usize) -> Entry {
        let [m, a] = self.texels[k];
        Entry::from_channels([m.x, m.y, m.z, m.w, a.x, a.y, a.z])
    }

    /// The table as `ltc_table` of `shaders/ltc.wgsl` takes it: two vec4f per entry.
    pub fn texels(&self) -> &[[Vec4; 2]] {
        &self.texels
    }

    /// The lobe at GGX width `alpha` (clamped to [`ALPHA_MIN`]..1) and view cosine `cos_theta` (clamped to 0..1).
    ///
    /// Bilinear in (√α, √(1 − cos θ)). Total: any f32 gives a finite lobe (NaN counts as the lower end). At normal view
    /// the lobe is round to the bit, so that the choice of the frame about the normal does not matter.
    #[inline]
    #[expect(clippy::manual_clamp, reason = "clamp would hand NaN on")]
    pub fn lobe(&self, alpha: f32, cos_theta: f32) -> Lobe {
        let alpha = alpha.max(ALPHA_MIN).min(1.0);
        let c = cos_theta.max(0.0).min(1.0);
        let half = (1.0 - c).sqrt();
        let s = half * (1.0 + c).sqrt();

        let x = (alpha.sqrt() - self.first) * self.steps;
        let y = half * (self.thetas - 1) as f32;
        let (i, j) = ((x as u32).min(self.alphas as u32 - 2), (y as u32).min(self.thetas as u32 - 2));
        let (fx, fy) = (x - i as f32, y - j as f32);
        let k = i as usize * self.thetas + j as usize;
        let (low, high) = (&self.texels[k..k + 2], &self.texels[k + self.thetas..k + self.thetas + 2]);
        let blend = |part: usize| {
            let left = low[0][part] + (high[0][part] - low[0][part]) * fx;
            let right = low[1][part] + (high[1][part] - low[1][part]) * fx;
            left + (right - left) * fy
        };
        let [ux, uz, beta, tau_x] = blend(0).to_array();
        let [tau_z, magnitude, fresnel, _] = blend(1).to_array();

        let tx = alpha * tau_x * c - tau_z * s;
        let tz = alpha * tau_x * s + tau_z * c;
        // M⁻¹ times α·area, the determinant of M's block in the plane of incidence: one division is left.
        let area = ux * tz - uz * tx;
        let m_inv = InverseMatrix { xx: tz, xz: -tx, yy: area / (beta * beta), zx: -alpha * uz, zz: alpha * ux };
        let m_row_z = Vec3::new(alpha * uz, 0.0, tz);
        // A half-space whose normal makes the angle γ with z holds (1 + cos γ)/2 of the clamped cosine.
        let above = 0.5 + 0.5 * tz / (m_row_z.x * m_row_z.x + tz * tz).sqrt();
        Lobe { m_inv, m_row_z, magnitude, fresnel, above, alpha, cos_theta: c }
    }
}

/// α at `share` of the table's axis, 0 to 1: equal steps of √α.
pub fn alpha_at(share: f64) -> f64 {
    let first = f64::from(ALPHA_MIN).sqrt();
    (first + (1.0 - first) * share).powi(2)
}

/// cos θ at `share` of the table's axis, 0 to 1: equal steps of √(1 − cos θ).
pub fn cos_theta_at(share: f64) -> f64 {
    1.0 - share * share
}

/// Whether a table may have these axes.
pub(super) fn check_axes(alphas: usize, thetas: usize, alpha_min: f32) -> Result<(), TableError> {
    let allowed = 2..=MAX_NODES;
    if allowed.contains(&alphas) && allowed.contains(&thetas) && alpha_min == ALPHA_MIN {
        return Ok(());
    }
    Err(TableError::Axes { alphas, thetas, alpha_min })
}

/// FNV-1a, 32 bits.
fn fnv1a(bytes: &[u8]) -> u32 {
    bytes.iter().fold(0x811c_9dc5, |hash, &b| (hash ^ u32::from(b)).wrapping_mul(0x0100_0193))
}
