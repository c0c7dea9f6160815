use std::sync::Arc;
use std::time::Instant;

use caustics_gpu_examples::picture::{FrameNotes, PassMilliseconds, offscreen, write_png};
use caustics_gpu_examples::stage::Stage;
use caustics_gpu_examples::{Failure, headless};
use caustics_gpu_readback::read_texture;
use caustics_wgpu::{SplatKernel, SplatMethod, SplatStats};
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::{ElementState, MouseButton, MouseScrollDelta, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::keyboard::{Key, NamedKey};
use winit::window::{Window, WindowId};

use crate::arguments::Arguments;
use crate::orbit::Orbit;

/// Opens a window and stays until it is closed, or until all frames are drawn.
pub(crate) fn run(arguments: Arguments) -> Result<(), Failure> {
    let event_loop = EventLoop::new()?;
    event_loop.set_control_flow(ControlFlow::Poll);
    let mut viewer = Viewer {
        orbit: Orbit::new(&arguments.scene()?)?,
        arguments,
        lines: Vec::new(),
        is_text_hidden: false,
        is_light_moved: false,
        open: None,
        failure: None,
        held: None,
        pointer: [0.0; 2],
        frame: 0,
    };
    event_loop.run_app(&mut viewer)?;
    viewer.failure.map_or(Ok(()), Err)
}

struct Viewer {
    arguments: Arguments,
    orbit: Orbit,
    /// What is shown of the frame before.
    lines: Vec<String>,
    is_text_hidden: bool,
    /// Whether the light has moved since it was aimed: the mouse tells more often than frames come.
    is_light_moved: bool,
    open: Option<OpenWindow>,
    failure: Option<Failure>,
    held: Option<MouseButton>,
    pointer: [f32; 2],
    frame: u32,
}

struct OpenWindow {
    window: Arc<Window>,
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    device: wgpu::Device,
    queue: wgpu::Queue,
    stage: Stage,
}

impl OpenWindow {
    fn new(event_loop: &ActiveEventLoop, arguments: &mut Arguments) -> Result<Self, Failure> {
        let [width, height] = arguments.size;
        let attributes = Window::default_attributes()
            .with_title("caustics")
            .with_inner_size(PhysicalSize::new(width, height));
        let window = Arc::new(event_loop.create_window(attributes)?);
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let surface = instance.create_surface(window.clone())?;
        let (adapter, device, queue) = headless::device(&instance, Some(&surface))?;
        arguments.fit(&adapter);
        println!("{}", adapter.get_info().name);
        let size = window.inner_size();
        let mut config = surface
            .get_default_config(&adapter, size.width.max(1), size.height.max(1))
            .ok_or("the adapter cannot draw into the window")?;
        let formats = surface.get_capabilities(&adapter).formats;
        if let Some(&format) = formats.iter().find(|format| format.is_srgb()) {
            config.format = format;
        }
        surface.configure(&device, &config);
        let size = [config.width, config.height];
        let scene = arguments.scene()?;
        let mut stage = Stage::new(
            &device,
            &queue,
            scene,
            size,
            config.format,
            arguments.trace(),
        )?;
        stage.set_splat(&device, arguments.splat)?;
        Ok(Self {
            window,
            surface,
            config,
            device,
            queue,
            stage,
        })
    }

    fn resize(&mut self, size: PhysicalSize<u32>) {
        if size.width > 0 && size.height > 0 {
            (self.config.width, self.config.height) = (size.width, size.height);
            self.surface.configure(&self.device, &self.config);
            let size = [size.width, size.height];
            self.stage.engine.resize(&self.device, size);
        }
    }
}

impl Viewer {
    fn draw(&mut self) -> Result<(), Failure> {
        if std::mem::take(&mut self.is_light_moved) {
            self.aim()?;
        }
        let Some(open) = &mut self.open else {
            return Ok(());
        };
        let start = Instant::now();
        let texture = match open.surface.get_current_texture() {
            wgpu::CurrentSurfaceTexture::Success(texture)
            | wgpu::CurrentSurfaceTexture::Suboptimal(texture) => texture,
            wgpu::CurrentSurfaceTexture::Outdated | wgpu::CurrentSurfaceTexture::Lost => {
                open.surface.configure(&open.device, &open.config);
                return Ok(());
            }
            // Not visible, or not in time: the next frame will do.
            _ => return Ok(()),
        };
        let view = texture
            .texture
            .create_view(&wgpu::TextureViewDescriptor::default());
        let look = self.orbit.look(self.arguments.exposure_ev)?;
        let descriptor = wgpu::CommandEncoderDescriptor::default();
        let mut encoder = open.device.create_command_encoder(&descriptor);
        let (device, queue) = (&open.device, &open.queue);
        let prepared = open.stage.draw(device, queue, &mut encoder, &look, &view)?;
        if !self.is_text_hidden {
            let engine = &open.stage.engine;
            engine.draw_text(queue, &mut encoder, &view, &self.lines);
        }
        let notes = FrameNotes::record(device, &mut encoder, &prepared)?;
        queue.submit([encoder.finish()]);
        open.window.pre_present_notify();
        queue.present(texture);
        // A viewer may wait for its timings; a game would read them a frame later.
        let (stats, times) = notes.read(device, &prepared)?;
        self.frame += 1;
        let milliseconds = 1e3 * start.elapsed().as_secs_f64();
        open.window
            .set_title(&format!("caustics: {milliseconds:.1} ms a frame"));
        self.note(milliseconds, &stats, &times);
        if self.arguments.frames.is_some() {
            println!("frame {}: {milliseconds:.1} ms", self.frame);
        }
        Ok(())
    }

    /// What the next frame shows of this one.
    fn note(&mut self, milliseconds: f64, stats: &SplatStats, times: &PassMilliseconds) {
        let splat = &self.arguments.splat;
        self.lines = vec![
            format!("{milliseconds:9.2} ms a frame"),
            format!("{:9} photons", self.arguments.photons()),
            format!("{:9} splats by {:?}", stats.splatted, splat.method),
            format!("          {:?} kernel", splat.kernel),
        ];
        if splat.kernel == SplatKernel::Gaussian {
            let how = if splat.integrate_pixels {
                "integrated over pixels"
            } else {
                "read at pixels"
            };
            self.lines.push(format!("          {how}"));
        }
        let passes = times.iter().map(|(pass, it)| format!("{it:9.2} ms {pass}"));
        self.lines.extend(passes);
    }

    /// The last frame once more, where it can be read.
    fn screenshot(&mut self) -> Result<(), Failure> {
        let (Some(open), Some(path)) = (&mut self.open, &self.arguments.screenshot) else {
            return Ok(());
        };
        let size = [open.config.width, open.config.height];
        let texture = offscreen(&open.device, size, open.config.format);
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let look = self.orbit.look(self.arguments.exposure_ev)?;
        let descriptor = wgpu::CommandEncoderDescriptor::default();
        let mut encoder = open.device.create_command_encoder(&descriptor);
        let (device, queue) = (&open.device, &open.queue);
        open.stage.draw(device, queue, &mut encoder, &look, &view)?;
        if !self.is_text_hidden {
            let engine = &open.stage.engine;
            engine.draw_text(queue, &mut encoder, &view, &self.lines);
        }
        queue.submit([encoder.finish()]);
        let mut pixels = read_texture(device, queue, &texture, 4)?;
        if matches!(
            open.config.format,
            wgpu::TextureFormat::Bgra8Unorm | wgpu::TextureFormat::Bgra8UnormSrgb
        ) {
            for pixel in pixels.chunks_exact_mut(4) {
                pixel.swap(0, 2);
            }
        }
        write_png(path, size, &pixels)?;
        println!("wrote {}", path.display());
        Ok(())
    }

    fn set_splat(&mut self) -> Result<(), Failure> {
        match &mut self.open {
            Some(open) => open.stage.set_splat(&open.device, self.arguments.splat),
            None => Ok(()),
        }
    }

    fn aim(&mut self) -> Result<(), Failure> {
        match &mut self.open {
            Some(open) => open.stage.aim(self.orbit.light(), self.arguments.trace()),
            None => Ok(()),
        }
    }

    fn press(&mut self, event_loop: &ActiveEventLoop, key: &Key) -> Result<(), Failure> {
        let splat = &mut self.arguments.splat;
        match key.as_ref() {
            Key::Named(NamedKey::Escape) => event_loop.exit(),
            Key::Character("t") => splat.method = SplatMethod::Tiles,
            Key::Character("q") => splat.method = SplatMethod::Quads,
            Key::Character("1") => splat.kernel = SplatKernel::Gaussian,
            Key::Character("2") => splat.kernel = SplatKernel::Ellipse,
            Key::Character("3") => splat.kernel = SplatKernel::Disc,
            Key::Character("4") => splat.kernel = SplatKernel::Tent,
            Key::Character("i") => splat.integrate_pixels = !splat.integrate_pixels,
            Key::Character("h") => {
                self.is_text_hidden = !self.is_text_hidden;
                return Ok(());
            }
            Key::Character("+" | "=") => {
                self.arguments.set_photons(2 * self.arguments.photons());
                return self.aim();
            }
            Key::Character("-") => {
                self.arguments.set_photons(self.arguments.photons() / 2);
                return self.aim();
            }
            _ => return Ok(()),
        }
        self.set_splat()
    }

    fn drag(&mut self, x: f32, y: f32) {
        let [from_x, from_y] = std::mem::replace(&mut self.pointer, [x, y]);
        match self.held {
            Some(MouseButton::Left) => self.orbit.turn(x - from_x, y - from_y),
            Some(MouseButton::Right) => {
                self.orbit.drag_light(x - from_x, y - from_y);
                self.is_light_moved = true;
            }
            _ => {}
        }
    }

    fn handle(&mut self, event_loop: &ActiveEventLoop, event: WindowEvent) -> Result<(), Failure> {
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::Resized(size) => {
                if let Some(open) = &mut self.open {
                    open.resize(size);
                }
            }
            WindowEvent::KeyboardInput { event, .. } if event.state == ElementState::Pressed => {
                self.press(event_loop, &event.logical_key)?;
            }
            WindowEvent::MouseInput { state, button, .. } => {
                self.held = (state == ElementState::Pressed).then_some(button);
            }
            WindowEvent::CursorMoved { position, .. } => {
                self.drag(position.x as f32, position.y as f32);
            }
            WindowEvent::MouseWheel { delta, .. } => {
                let lines = match delta {
                    MouseScrollDelta::LineDelta(_, y) => y,
                    MouseScrollDelta::PixelDelta(position) => position.y as f32 / 50.0,
                };
                self.orbit.zoom(0.9f32.powf(lines));
            }
            // A frame may take seconds on a software adapter: none after the last.
            WindowEvent::RedrawRequested if event_loop.exiting() => {}
            WindowEvent::RedrawRequested => {
                self.draw()?;
                if self
                    .arguments
                    .frames
                    .is_some_and(|frames| self.frame >= frames)
                {
                    self.screenshot()?;
                    event_loop.exit();
                } else if let Some(open) = &self.open {
                    open.window.request_redraw();
                }
            }
            _ => {}
        }
        Ok(())
    }
}

impl ApplicationHandler for Viewer {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.open.is_none() {
            match OpenWindow::new(event_loop, &mut self.arguments) {
                Ok(open) => {
                    open.window.request_redraw();
                    self.open = Some(open);
                }
                Err(failure) => {
                    self.failure = Some(failure);
                    event_loop.exit();
                }
            }
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        if let Err(failure) = self.handle(event_loop, event) {
            self.failure = Some(failure);
            event_loop.exit();
        }
    }
}
