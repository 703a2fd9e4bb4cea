use std::fs;
use std::path::Path;

use clap::Parser;
use in_process::Team;
use missions::waste::data::default_scenario;
use proto::control::AgentState;
use run_log::recorder::Folder;
use run_log::{LogLevel, RunLog, RunOutcome};
use scenario::ids::Tick;
use scenario::time::SimTime;
use scenario::{Robot, Scenario};
use tempfile::TempDir;

use super::camera::take_scenes;
use super::drawing::Drawing;
use super::film::{self, FilmFormat};
use super::scene::Scene;
use crate::export::ExportCommand;
use crate::figures::canvas::Sheet;
use crate::figures::pixels::Pixels;
use crate::replay::replay;
use crate::testkit::{open, run, scenario, setup, shipped};

/// The default mission, in which gold is killed and blue is cut off.
fn mission(limit_s: f64) -> Scenario {
    let faults = scenario(
        "faults.timeline = [{ fault.kill = \"gold\", at_s = 70.0 }, { fault.mute = \"blue\", at_s = 60.0 }]\n[waste]\n",
    );
    Scenario {
        limit_s,
        faults: faults.faults,
        ..default_scenario()
    }
}

fn scenes(log: &RunLog, ticks: &[Tick]) -> Vec<Scene> {
    let mut scenes = Vec::new();
    let differs = take_scenes(log, ticks, |scene| {
        scenes.push(scene);
        Ok(())
    });
    assert_eq!(differs.unwrap(), None);
    scenes
}

fn drawing(log: &RunLog) -> Drawing<'_> {
    let end = SimTime::from_secs_f64(log.run.setup.scenario.limit_s);
    Drawing::new(&log.run.setup, end, Sheet::default())
}

/// Decodes a PNG of one image.
fn decoded(png: &[u8]) -> Pixels {
    let mut reader = png::Decoder::new(png).read_info().unwrap();
    let mut rgb = vec![0; reader.output_buffer_size()];
    let info = reader.next_frame(&mut rgb).unwrap();
    Pixels {
        width: info.width,
        height: info.height,
        rgb,
    }
}

fn color_at(image: &Pixels, (x, y): (f64, f64)) -> [u8; 3] {
    let pixel = (y as usize * image.width as usize + x as usize) * 3;
    [image.rgb[pixel], image.rgb[pixel + 1], image.rgb[pixel + 2]]
}

#[test]
fn a_png_has_the_color_of_each_robot_at_its_pose() {
    let log = run(setup(mission(80.0)));
    let drawing = drawing(&log);
    for scene in scenes(&log, &[0, 1000, 1600]) {
        let png = Pixels::draw(&drawing.svg(&scene), 2.0)
            .unwrap()
            .png()
            .unwrap();
        let image = decoded(&png);
        assert_eq!(image.width, 1920);
        for (rank, robot) in scene.view.robots.iter().enumerate() {
            let (x, y) = drawing.place(robot.pose.position);
            let color = color_at(&image, (2.0 * x, 2.0 * y));
            let own = drawing.colors()[rank];
            let is_dead = robot.state == AgentState::Dead;
            assert_eq!(is_dead, rank == 1 && scene.view.tick == 1600);
            let expected = if is_dead {
                [184, 51, 10]
            } else {
                [own.0, own.1, own.2]
            };
            assert_eq!(color, expected, "robot {rank} at {}", scene.view.now);
        }
    }
}

#[test]
fn a_picture_shows_messages_and_faults() {
    let log = run(setup(mission(80.0)));
    let scenes = scenes(&log, &[1000, 1600]);
    let lost = |scene: &Scene| {
        scene
            .transmissions
            .iter()
            .filter(|each| each.is_lost)
            .count()
    };
    assert_eq!(lost(&scenes[0]), 0);
    assert!(!scenes[0].transmissions.is_empty());
    let senders = scenes[1].transmissions.iter().filter(|each| each.is_lost);
    for each in senders {
        assert_eq!(each.sender.index(), 0, "only blue is mute");
    }
    let svg = drawing(&log).svg(&scenes[1]);
    for text in [
        "kill gold since 70.0 s",
        "mute blue since 60.0 s",
        "1 dead",
        ">80.0 s<",
        "spill (top)",
    ] {
        assert!(svg.contains(text), "{text}: {svg}");
    }
    assert!(!drawing(&log).svg(&scenes[0]).contains("since"));
}

#[test]
fn the_svg_of_a_small_run() {
    let mut small = default_scenario();
    small.limit_s = 2.0;
    small.robots.truncate(1);
    let log = run(setup(small));
    let scene = &scenes(&log, &[40])[0];
    insta::assert_snapshot!(drawing(&log).svg(scene).replace("><", ">\n<"));
}

#[test]
fn the_picture_of_a_replay_equals_that_of_the_log_at_each_level() {
    let log = run(setup(mission(75.0)));
    let picture = |log: &RunLog| drawing(log).svg(&scenes(log, &[1500])[0]);
    let first = picture(&log);
    assert_eq!(picture(&log), first);
    for level in [LogLevel::Full, LogLevel::Summary, LogLevel::Off] {
        let (memory, _) = replay(&log, level, |_| {}).unwrap();
        assert!(picture(&open(&memory)) == first, "{level:?}");
    }
}

#[test]
fn every_mission_and_a_large_team_can_be_drawn() {
    for name in ["janitorial", "parker-box", "cmommt", "foraging"] {
        let mut shipped = shipped(name);
        shipped.limit_s = 5.0;
        let log = run(setup(shipped));
        let svg = drawing(&log).svg(&scenes(&log, &[100])[0]);
        Pixels::draw(&svg, 1.0).unwrap();
    }
    let family = default_scenario();
    let family = setup(family).catalog.mission.family(40, 20).unwrap();
    let log = run(setup(Scenario {
        limit_s: 1.0,
        ..family
    }));
    let svg = drawing(&log).svg(&scenes(&log, &[20])[0]);
    let robots = &log.run.setup.scenario.robots;
    let is_named = |robot: &&Robot| svg.contains(&format!(">{}<", robot.name));
    assert!(robots.iter().filter(is_named).count() >= 30, "{svg}");
    assert!(svg.contains("40 robots: 40 "), "{svg}");
}

/// The frames of a short film as SVG and as images.
fn frames() -> (Vec<String>, Vec<Pixels>) {
    let log = run(setup(mission(75.0)));
    let drawing = drawing(&log);
    let ticks: Vec<Tick> = (0..=6).map(|frame| 1380 + 20 * frame).collect();
    let svgs: Vec<String> = scenes(&log, &ticks)
        .iter()
        .map(|scene| drawing.svg(scene))
        .collect();
    let images = svgs.iter().map(|svg| Pixels::draw(svg, 1.0).unwrap());
    let images = images.collect();
    (svgs, images)
}

#[test]
fn an_animated_webp_has_every_frame_without_loss() {
    let (svgs, images) = frames();
    let mut film = Vec::new();
    film::write(&svgs, 15, FilmFormat::Webp, &[], &mut film).unwrap();
    let mut again = Vec::new();
    film::write(&svgs, 15, FilmFormat::Webp, &[], &mut again).unwrap();
    assert!(film == again);
    let decoder = webp_animation::Decoder::new(&film).unwrap();
    let decoded: Vec<_> = decoder.into_iter().collect();
    for (index, (frame, image)) in decoded.iter().zip(&images).enumerate() {
        assert_eq!(frame.dimensions(), (image.width, image.height));
        let rgb = frame.data().chunks_exact(4).flat_map(|pixel| &pixel[..3]);
        assert!(rgb.eq(&image.rgb), "frame {index}");
    }
    // A frame lasts a fifteenth of a second, and the last one two seconds.
    let ends: Vec<_> = decoded.iter().map(|frame| frame.timestamp()).collect();
    assert_eq!(ends, [66, 133, 200, 266, 333, 400, 2400]);
}

#[test]
fn a_gif_has_every_frame_with_nearly_the_same_colors() {
    let (svgs, images) = frames();
    let mut film = Vec::new();
    film::write(&svgs, 15, FilmFormat::Gif, &[], &mut film).unwrap();
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(&film[..]).unwrap();
    let width = images[0].width as usize;
    let mut canvas = vec![0_u8; images[0].rgb.len()];
    let mut delays = Vec::new();
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        for (place, pixel) in frame.buffer.chunks_exact(4).enumerate() {
            let (x, y) = (
                place % usize::from(frame.width),
                place / usize::from(frame.width),
            );
            let at = ((y + usize::from(frame.top)) * width + x + usize::from(frame.left)) * 3;
            if pixel[3] > 0 {
                canvas[at..at + 3].copy_from_slice(&pixel[..3]);
            }
        }
        let image = &images[delays.len()];
        delays.push(frame.delay);
        let far = canvas
            .iter()
            .zip(&image.rgb)
            .filter(|(a, b)| a.abs_diff(**b) > 24)
            .count();
        assert!(far < canvas.len() / 2000, "{far} of {}", canvas.len());
    }
    // A frame lasts a fifteenth of a second, and the last one two seconds.
    assert_eq!(delays, [6, 7, 7, 6, 7, 7, 200]);
}

#[derive(Parser)]
struct Export {
    #[command(flatten)]
    export: ExportCommand,
}

/// Runs `alliance export` and returns the error.
fn export(folder: &Path, words: &str) -> Result<(), String> {
    let folder = folder.display().to_string();
    let words = ["alliance", &folder].into_iter().chain(words.split(' '));
    let parsed = Export::try_parse_from(words).map_err(|error| error.to_string())?;
    parsed
        .export
        .export(|_, _| Ok(()))
        .map_err(|error| format!("{error:#}"))
}

fn logged(level: LogLevel) -> TempDir {
    let folder = TempDir::new().unwrap();
    let sink = Folder::create(folder.path()).unwrap();
    let setup = setup(Scenario {
        limit_s: 3.0,
        ..default_scenario()
    });
    Team::new(setup, level, sink).unwrap().run().unwrap();
    folder
}

#[test]
fn pictures_and_a_film_are_written_into_files() {
    let run = logged(LogLevel::Summary);
    let folder = run.path();
    fs::write(folder.join("room-at-1s.png"), "older").unwrap();
    let film = folder.join("film.gif").display().to_string();
    let words =
        format!("--svg --png 1s,end --video {film} --from 1s --fps 10 --speed 2x --width 500");
    export(folder, &words).unwrap();
    let png = |name: &str| decoded(&fs::read(folder.join(name)).unwrap());
    assert_eq!(png("room-at-1s.png").width, 1000);
    let svg = fs::read_to_string(folder.join("room-at-3s.svg")).unwrap();
    let image = Pixels::draw(&svg, 2.0).unwrap();
    assert!(image == png("room-at-3s.png"));
    let mut decoder = gif::DecodeOptions::new()
        .read_info(fs::File::open(&film).unwrap())
        .unwrap();
    let mut frames = 0;
    while decoder.read_next_frame().unwrap().is_some() {
        frames += 1;
    }
    // From 1 s to 3 s at twice the real time: a second, and the end.
    assert_eq!(frames, 11);
    let out = folder.join("pictures");
    export(folder, &format!("--svg 0.07s --out {}", out.display())).unwrap();
    assert!(out.join("room-at-0.05s.svg").exists());
}

#[test]
fn an_impossible_picture_is_refused_in_one_line() {
    let run = logged(LogLevel::Off);
    let folder = run.path();
    let names = || fs::read_dir(folder).unwrap().count();
    let before = names();
    let refusals = [
        "--png 3.05s",
        "--svg 1s,late",
        "--video film.mp4",
        "--video film.gif --from 4s",
        "--video film.gif --from 2s --to 1s",
        "--video film.gif --speed max",
        "--video film.gif --speed 0.001x",
        "--video film.gif --fps 0",
        "--png end --width 20",
        "--parquet --width 500",
        "--png end --fps 10",
        "--svg --speed 2x",
        "--video no/such/folder/film.gif",
    ]
    .map(|words| {
        let error = export(folder, words).unwrap_err();
        assert_eq!(names(), before, "{words}");
        format!("{words}\n    {}", error.lines().next().unwrap_or_default())
    });
    insta::assert_snapshot!(refusals.join("\n"));
}

#[test]
fn a_run_without_a_tick_has_no_picture() {
    let mut log = run(setup(Scenario {
        limit_s: 1.0,
        ..default_scenario()
    }));
    // As after a crash before the first complete tick.
    (log.run.outcome, log.last) = (RunOutcome::Running, None);
    let error = take_scenes(&log, &[0], |_| Ok(())).unwrap_err().to_string();
    assert_eq!(error, "the log has no complete tick");
}

#[test]
fn labels_do_not_overlap() {
    use super::geometry::{Extent, Taken};
    let within = Extent::around((50.0, 50.0), 50.0, 50.0);
    let mut taken = Taken::new(within);
    let place = |x: f64| Extent::around((x, 50.0), 10.0, 5.0);
    taken.take(place(50.0));
    let free = taken.first_free([
        (1, place(45.0)),
        (2, place(95.0)),
        (3, place(30.0)),
        (4, place(70.0)),
    ]);
    assert_eq!(free.map(|(which, _)| which), Some(3));
    assert_eq!(taken.first_free([(3, place(30.0))]), None);
    assert!(within.contains(&place(90.0)));
}
