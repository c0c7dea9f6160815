use bytemuck::{Pod, Zeroable};

/// Letters in a line, and lines. Mirrors the constants in `overlay.wgsl`.
const COLUMNS: usize = 44;
const ROWS: usize = 20;

/// Pixels of a dot.
const DOT: u32 = 2;

/// Letters of 3 by 5 dots, row by row: a lowercase letter is shown as its capital.
const GLYPHS: [(char, [u8; 5]); 47] = [
    ('0', [7, 5, 5, 5, 7]),
    ('1', [2, 6, 2, 2, 7]),
    ('2', [7, 1, 7, 4, 7]),
    ('3', [7, 1, 7, 1, 7]),
    ('4', [5, 5, 7, 1, 1]),
    ('5', [7, 4, 7, 1, 7]),
    ('6', [7, 4, 7, 5, 7]),
    ('7', [7, 1, 2, 2, 2]),
    ('8', [7, 5, 7, 5, 7]),
    ('9', [7, 5, 7, 1, 7]),
    ('A', [2, 5, 7, 5, 5]),
    ('B', [6, 5, 6, 5, 6]),
    ('C', [3, 4, 4, 4, 3]),
    ('D', [6, 5, 5, 5, 6]),
    ('E', [7, 4, 6, 4, 7]),
    ('F', [7, 4, 6, 4, 4]),
    ('G', [3, 4, 5, 5, 3]),
    ('H', [5, 5, 7, 5, 5]),
    ('I', [7, 2, 2, 2, 7]),
    ('J', [1, 1, 1, 5, 2]),
    ('K', [5, 5, 6, 5, 5]),
    ('L', [4, 4, 4, 4, 7]),
    ('M', [5, 7, 7, 5, 5]),
    ('N', [6, 5, 5, 5, 5]),
    ('O', [2, 5, 5, 5, 2]),
    ('P', [6, 5, 6, 4, 4]),
    ('Q', [2, 5, 5, 6, 3]),
    ('R', [6, 5, 6, 5, 5]),
    ('S', [3, 4, 2, 1, 6]),
    ('T', [7, 2, 2, 2, 2]),
    ('U', [5, 5, 5, 5, 7]),
    ('V', [5, 5, 5, 5, 2]),
    ('W', [5, 5, 7, 7, 5]),
    ('X', [5, 5, 2, 5, 5]),
    ('Y', [5, 5, 2, 2, 2]),
    ('Z', [7, 1, 2, 4, 7]),
    ('.', [0, 0, 0, 0, 2]),
    (',', [0, 0, 0, 2, 4]),
    (':', [0, 2, 0, 2, 0]),
    ('-', [0, 0, 7, 0, 0]),
    ('_', [0, 0, 0, 0, 7]),
    ('+', [0, 2, 7, 2, 0]),
    ('/', [1, 1, 2, 4, 4]),
    ('%', [5, 1, 2, 4, 5]),
    ('(', [2, 4, 4, 4, 2]),
    (')', [2, 1, 1, 1, 2]),
    ('=', [0, 7, 0, 7, 0]),
];

/// Mirror of the struct of the same name in `overlay.wgsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Text {
    used: [u32; 2],
    dot: u32,
    pad: u32,
    glyphs: [u32; COLUMNS * ROWS],
}

impl Text {
    /// The first lines, and of each its first letters; blanks for letters that there are not.
    fn of(lines: &[String]) -> Self {
        let mut text = Self {
            used: [0; 2],
            dot: DOT,
            pad: 0,
            glyphs: [0; COLUMNS * ROWS],
        };
        for (row, line) in lines.iter().take(ROWS).enumerate() {
            for (column, letter) in line.chars().take(COLUMNS).enumerate() {
                text.glyphs[row * COLUMNS + column] = dots(letter);
                text.used[0] = text.used[0].max(column as u32 + 1);
            }
            text.used[1] = row as u32 + 1;
        }
        text
    }
}

/// The dots of a letter, 15 bits.
fn dots(letter: char) -> u32 {
    let capital = letter.to_ascii_uppercase();
    let found = GLYPHS.iter().find(|(it, _)| *it == capital);
    found.map_or(0, |(_, rows)| {
        rows.iter().fold(0, |bits, &row| bits << 3 | u32::from(row))
    })
}

/// Draws lines of text.
#[derive(Debug)]
pub(super) struct Overlay {
    text: wgpu::Buffer,
    group: wgpu::BindGroup,
    pipeline: wgpu::RenderPipeline,
}

impl Overlay {
    pub(super) fn new(device: &wgpu::Device, format: wgpu::TextureFormat) -> Self {
        let source = wgpu::ShaderSource::Wgsl(include_str!("overlay.wgsl").into());
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("overlay"),
            source,
        });
        let target = wgpu::ColorTargetState {
            format,
            blend: Some(wgpu::BlendState::ALPHA_BLENDING),
            write_mask: wgpu::ColorWrites::ALL,
        };
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("overlay"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("overlay_corner"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: None,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("overlay_letters"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(target)],
            }),
            multiview_mask: None,
            cache: None,
        });
        let text = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("overlay"),
            size: size_of::<Text>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("overlay"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: text.as_entire_binding(),
            }],
        });
        Self {
            text,
            group,
            pipeline,
        }
    }

    /// Draws lines onto what is there.
    pub(super) fn draw(
        &self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        into: &wgpu::TextureView,
        lines: &[String],
    ) {
        queue.write_buffer(&self.text, 0, bytemuck::bytes_of(&Text::of(lines)));
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("overlay"),
            color_attachments: &[Some(super::color(into, wgpu::LoadOp::Load))],
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.draw(0..3, 0..1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_are_dots_from_the_upper_left_on() {
        assert_eq!(dots('l'), 0b100_100_100_100_111);
        assert_eq!(dots('~'), 0);
        let text = Text::of(&["ab".to_owned(), String::new(), "c".repeat(99)]);
        assert_eq!(text.used, [COLUMNS as u32, 3]);
        assert_eq!(text.glyphs[2 * COLUMNS], dots('C'));
    }
}
