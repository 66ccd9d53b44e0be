//! The picture in tiles: what is drawn for each, and what comes back.

use super::buffers::{Content, Readback, SceneBuffers, target};
use super::clock::{Clock, Timer};
use super::device::Device;
use super::layout::{Emitters, Frame, Pixel};
use super::pipelines::{DEPTH_FORMAT, Layouts, Pipelines, VISIBILITY_FORMAT};
use super::window::Windows;
use crate::backend::{BackendError, Technique};
use glam::{DVec2, UVec2, Vec2, Vec4};
use wgpu::{BindGroup, Buffer, CommandEncoder, ComputePassTimestampWrites, TextureFormat, TextureUsages, TextureView};

/// Longest side of a tile, pixels.
const LONGEST: u32 = 1024;
/// Shortest side of a tile, where the picture is not shorter.
const SHORTEST: u32 = 128;
/// Pixels times emitters of one dispatch: drivers end those that take seconds.
const WORK: u32 = 1 << 26;
/// Pixels around a tile that the G-buffer holds beside it.
const BORDER: u32 = 1;
/// Pixels along a side of a workgroup.
const GROUP: u32 = 8;

/// A part of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tile {
    /// First pixel.
    pub origin: UVec2,
    /// Pixels across and down.
    pub size: UVec2,
}

/// What lights weigh in the work of a pixel: of those in clusters few are integrated.
const fn weight(frame: &Frame) -> u32 {
    frame.emitters + frame.clusters / 16
}

impl Tile {
    /// The longest side of the tiles of a scene with that many emitters.
    fn side(emitters: u32) -> u32 {
        (WORK / emitters.max(1)).isqrt().next_multiple_of(GROUP).clamp(SHORTEST, LONGEST)
    }

    /// The size of the largest tile of a picture.
    fn largest(frame: &Frame) -> UVec2 {
        frame.picture.min(UVec2::splat(Self::side(weight(frame))))
    }

    /// The tiles of a picture, row by row.
    pub fn all(frame: &Frame) -> impl Iterator<Item = Self> {
        let (picture, side) = (frame.picture, Self::side(weight(frame)));
        let rows = (0..picture.y).step_by(side as usize);
        rows.flat_map(move |y| (0..picture.x).step_by(side as usize).map(move |x| UVec2::new(x, y)))
            .map(move |origin| Self { origin, size: (picture - origin).min(UVec2::splat(side)) })
    }

    /// A step that goes through all its rows of workgroups, those of any stretch spread over the tile: near the golden section of their
    /// number, and coprime to it.
    fn row_step(&self) -> u32 {
        let rows = self.size.y.div_ceil(GROUP);
        let has_common_divisor = |step: u32| {
            let (mut a, mut b) = (rows, step);
            while b > 0 {
                (a, b) = (b, a % b);
            }
            a > 1
        };
        let first = (rows * 5 / 8).max(1);
        (first..=rows.max(1)).find(|&step| !has_common_divisor(step)).unwrap_or(1)
    }

    /// From the picture's −1..1 to the tile's, for a sample that is rasterised at its pixel's centre.
    fn raster(&self, picture: UVec2, offset: [f32; 2]) -> Vec4 {
        let target = (self.size + 2 * BORDER).as_dvec2();
        let first = self.origin.as_dvec2() - f64::from(BORDER);
        let offset = Vec2::from_array(offset).as_dvec2();
        let scale = picture.as_dvec2() / target;
        // Where the picture's middle falls, in pixels of the target from its upper left corner.
        let middle = picture.as_dvec2() * 0.5 - offset + 0.5 - first;
        let shift = (middle / target * 2.0 - 1.0) * DVec2::new(1.0, -1.0);
        Vec4::new(scale.x as f32, scale.y as f32, shift.x as f32, shift.y as f32)
    }
}

/// What the tiles of pictures are drawn with: the scene, and what tiles are drawn to.
pub struct Painter<'a> {
    device: &'a Device,
    layouts: &'a Layouts,
    buffers: SceneBuffers,
    scene: BindGroup,
    triangles: u32,
    size: UVec2,
    tile: BindGroup,
    visibility: TextureView,
    depth: TextureView,
    pixels: Buffer,
    skips: Buffer,
    /// The counters as they were before the tile.
    skips_before: Buffer,
    counters: u64,
    readback: Readback,
    timer: Timer,
    /// Windows that the tiles are painted in: as many as the most laborious one so far has wanted.
    windows: Windows,
}

/// What is the same for all tiles of a picture.
pub struct Work<'a> {
    /// The lights.
    pub emitters: &'a Emitters,
    /// How they are integrated.
    pub technique: &'a Technique,
    /// The samples' places in their pixels.
    pub offsets: &'a [[f32; 2]],
    /// The picture.
    pub frame: &'a Frame,
}

impl<'a> Painter<'a> {
    /// For the tiles of pictures as large as this, with that many emitters, triangles and skip counters, at least one.
    pub fn new(
        device: &'a Device,
        layouts: &'a Layouts,
        clock: &Clock,
        contents: &[Content<'_>],
        frame: &Frame,
        triangles: u32,
        counters: u64,
    ) -> Result<Self, BackendError> {
        let buffers = SceneBuffers::new(device, contents)?;
        let size = Tile::largest(frame);
        let bytes = u64::from(size.x * size.y) * size_of::<Pixel>() as u64;
        let pixels = target(device, "pixels", bytes)?;
        let [skips, skips_before] =
            [target(device, "skip counters", counters * 8)?, target(device, "skip counters", counters * 8)?];
        let readback = Readback::new(device, bytes.max(counters * 8));
        let visibility = texture(device, size, VISIBILITY_FORMAT, TextureUsages::TEXTURE_BINDING);
        let depth = texture(device, size, DEPTH_FORMAT, TextureUsages::empty());
        let scene = layouts.bind_scene(device, &buffers);
        let tile = layouts.bind_tile(device, &visibility, &pixels, &skips);
        let timer = Timer::new(device, clock);
        device.check()?;
        Ok(Self {
            device,
            layouts,
            buffers,
            scene,
            triangles,
            size,
            tile,
            visibility,
            depth,
            pixels,
            skips,
            skips_before,
            counters,
            readback,
            timer,
            windows: Windows::new(1),
        })
    }

    /// Whether it can paint a picture with that many emitters, triangles and skip counters.
    pub fn serves(&self, frame: &Frame, triangles: u32, counters: u64) -> bool {
        self.size == Tile::largest(frame) && self.triangles == triangles && self.counters == counters
    }

    /// Makes ready for the next picture.
    pub fn renew(&mut self, contents: &[Content<'_>]) -> Result<(), BackendError> {
        if self.buffers.renew(self.device, contents)? {
            self.scene = self.layouts.bind_scene(self.device, &self.buffers);
        }
        let mut encoder = self.encoder();
        encoder.clear_buffer(&self.skips, 0, None);
        self.device.queue.submit([encoder.finish()]);
        self.device.check()
    }

    fn encoder(&self) -> CommandEncoder {
        self.device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
    }

    /// Draws all samples of a tile and shows its pixels, row by row, to `look`. `compiled` gives the passes for all of the lights at
    /// once, or for windows.
    pub fn paint(
        &mut self,
        compiled: impl Fn(bool) -> Result<Pipelines, BackendError>,
        tile: Tile,
        work: &Work<'_>,
        mut look: impl FnMut(&[Pixel]),
    ) -> Result<(), BackendError> {
        loop {
            let windows = self.windows;
            let pipelines = compiled(windows.are_many())?;
            let mut encoder = self.encoder();
            encoder.copy_buffer_to_buffer(&self.skips, 0, &self.skips_before, 0, None);
            encoder.clear_buffer(&self.pixels, 0, None);
            self.device.queue.submit([encoder.finish()]);
            for &offset in work.offsets {
                self.sample(&pipelines, tile, work.frame, offset, windows)?;
            }
            self.timer.collect(self.device)?;
            let pixels = u64::from(tile.size.x * tile.size.y);
            let is_cut = self.readback.read(self.device, &self.pixels, pixels, |painted: &[Pixel]| {
                let is_cut = painted.iter().any(|pixel| pixel.cut > 0);
                if !is_cut {
                    look(painted);
                }
                is_cut
            })?;
            if !is_cut {
                return Ok(());
            }
            self.windows = windows.more(self.device, work.emitters, work.technique)?;
            let mut encoder = self.encoder();
            encoder.copy_buffer_to_buffer(&self.skips_before, 0, &self.skips, 0, None);
            self.device.queue.submit([encoder.finish()]);
        }
    }

    /// Draws a sample of all pixels of a tile.
    fn sample(
        &mut self,
        pipelines: &Pipelines,
        tile: Tile,
        frame: &Frame,
        offset: [f32; 2],
        windows: Windows,
    ) -> Result<(), BackendError> {
        for window in windows.all() {
            let frame = Frame {
                raster: tile.raster(frame.picture, offset),
                tile_origin: tile.origin,
                tile_size: tile.size,
                row_step: tile.row_step(),
                offset: offset.into(),
                window,
                ..*frame
            };
            self.device.queue.write_buffer(&self.buffers.frame, 0, bytemuck::bytes_of(&frame));
            let mut encoder = self.encoder();
            if window.x == 0 {
                self.draw(pipelines, &mut encoder, tile);
            }
            let pass = Shading { pipelines, scene: &self.scene, tile: &self.tile, size: tile.size };
            if self.timer.has_timestamps() {
                pass.shade(&mut encoder, self.timer.writes());
                self.device.queue.submit([encoder.finish()]);
            } else {
                self.device.queue.submit([encoder.finish()]);
                self.timer.by_the_wall(self.device, |encoder| pass.shade(encoder, None))?;
            }
            if self.timer.is_full() {
                self.timer.collect(self.device)?;
            }
            // Frees what finished samples have used.
            let polled = self.device.device.poll(wgpu::PollType::Poll);
            polled.map_err(|e| BackendError::Device(e.to_string()))?;
            self.device.check()?;
        }
        Ok(())
    }

    /// Paints in as many windows at least.
    pub fn begin_with(&mut self, windows: Windows) {
        self.windows = self.windows.max(windows);
    }

    /// Windows of each light that the tiles so far have wanted.
    pub const fn windows(&self) -> u32 {
        self.windows.count()
    }

    /// The skip counters of all rows.
    pub fn skips(&self) -> Result<Vec<u64>, BackendError> {
        self.readback.read(self.device, &self.skips, self.counters, <[u64]>::to_vec)
    }

    /// Seconds that shading has taken since the last call.
    pub fn seconds(&mut self) -> Result<f64, BackendError> {
        self.timer.take(self.device)
    }

    fn draw(&self, pipelines: &Pipelines, encoder: &mut CommandEncoder, tile: Tile) {
        let nothing = |load| wgpu::Operations { load: wgpu::LoadOp::Clear(load), store: wgpu::StoreOp::Store };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("gbuffer"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.visibility,
                depth_slice: None,
                resolve_target: None,
                ops: nothing(wgpu::Color::TRANSPARENT),
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Discard }),
                stencil_ops: None,
            }),
            ..wgpu::RenderPassDescriptor::default()
        });
        let target = (tile.size + 2 * BORDER).as_vec2();
        pass.set_viewport(0.0, 0.0, target.x, target.y, 0.0, 1.0);
        pass.set_pipeline(&pipelines.gbuffer);
        pass.set_bind_group(0, &self.scene, &[]);
        pass.draw(0..self.triangles * 3, 0..1);
    }
}

/// The pass that shades a tile.
struct Shading<'a> {
    pipelines: &'a Pipelines,
    scene: &'a BindGroup,
    tile: &'a BindGroup,
    size: UVec2,
}

impl Shading<'_> {
    fn shade(&self, encoder: &mut CommandEncoder, timestamp_writes: Option<ComputePassTimestampWrites<'_>>) {
        let mut pass =
            encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("light"), timestamp_writes });
        pass.set_pipeline(&self.pipelines.light);
        pass.set_bind_group(0, self.scene, &[]);
        pass.set_bind_group(1, self.tile, &[]);
        pass.dispatch_workgroups(self.size.x.div_ceil(GROUP), self.size.y.div_ceil(GROUP), 1);
    }
}

fn texture(device: &Device, tile: UVec2, format: TextureFormat, usage: TextureUsages) -> TextureView {
    let size = tile + 2 * BORDER;
    let texture = device.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("gbuffer"),
        size: wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: usage | TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    });
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;

    #[test]
    fn tiles_cover_the_picture_once() {
        for (width, height, emitters) in [(1, 1, 0), (1024, 1024, 1), (1025, 300, 64), (700, 3000, 100_000)] {
            let frame = Frame { picture: UVec2::new(width, height), emitters, ..Frame::zeroed() };
            let mut covered = vec![0_u8; (width * height) as usize];
            for tile in Tile::all(&frame) {
                assert!(tile.size.max_element() <= Tile::side(emitters));
                let (rows, step) = (tile.size.y.div_ceil(GROUP), tile.row_step());
                let mut order: Vec<u32> = (0..rows).map(|row| row * step % rows).collect();
                let half: u32 = order[..rows as usize / 2].iter().sum();
                // Rows of both halves are at the same height on average, to a few rows.
                let all = rows * rows.saturating_sub(1) / 2;
                assert!((2 * half).abs_diff(all) <= 6 * rows, "{rows} rows, step {step}");
                order.sort_unstable();
                assert!(order.into_iter().eq(0..rows));
                for y in tile.origin.y..tile.origin.y + tile.size.y {
                    for x in tile.origin.x..tile.origin.x + tile.size.x {
                        covered[(y * width + x) as usize] += 1;
                    }
                }
            }
            assert!(covered.iter().all(|&n| n == 1));
        }
        assert_eq!([0, 64, 1000, u32::MAX].map(Tile::side), [1024, 1024, 264, 128]);
    }
}
