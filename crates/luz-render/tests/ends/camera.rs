//! What a camera responds to is what it sees: the film's positions, back and forth, and their density.

use super::SIGNIFICANCE;
use glam::{Mat4, Vec2, Vec3, Vec4};
use luz_geometry::{AnimatedTransform, Frame, Transform};
use luz_render::SphereMap;
use luz_render::camera::{Camera, CameraEnd, CameraPlace, Lens, Projection, ScreenWindow};
use luz_sample::Samples;
use luz_sample::random::Random;
use luz_sample::test_support::{Chi2Result, chi2_rectangle, chi2_sphere, sidak};

const RESOLUTION: [u32; 2] = [60, 40];
const PINHOLE: Lens = Lens { radius: 0.0, focal_distance: 1e6 };
const LENS: Lens = Lens { radius: 0.3, focal_distance: 4.0 };

fn size() -> Vec2 {
    Vec2::new(RESOLUTION[0] as f32, RESOLUTION[1] as f32)
}

fn camera(projection: Projection, lens: Lens, start: &Transform, end: &Transform) -> Camera {
    let placed = AnimatedTransform::new(*start, 0.0, *end, 1.0);
    Camera::new(projection, 75.0, ScreenWindow::of_aspect(1.5), lens, [0.25, 0.75], RESOLUTION, placed)
}

/// Cameras of every projection: at rest, turned and moving, squeezed, sheared and mirrored.
pub fn cameras() -> Vec<(String, Camera)> {
    let rest = Transform::IDENTITY;
    let turned = Transform::translate(Vec3::new(1.0, -2.0, 0.5))
        .compose(&Transform::rotate(1.1, Vec3::new(1.0, 2.0, -0.5)).expect("an axis"));
    let squeezed = turned.compose(&Transform::scale(Vec3::new(1.5, -0.4, 2.0)).expect("a scale"));
    let shear = Mat4::from_cols(
        Vec4::new(1.0, 0.2, 0.0, 0.0),
        Vec4::new(0.5, 1.0, 0.1, 0.0),
        Vec4::new(-0.3, 0.2, 0.8, 0.0),
        Vec4::W,
    );
    let sheared = turned.compose(&Transform::from_parts(shear, shear.inverse()));
    let projections = [
        ("perspective", Projection::Perspective, PINHOLE),
        ("lens", Projection::Perspective, LENS),
        ("orthographic", Projection::Orthographic, PINHOLE),
        ("orthographic lens", Projection::Orthographic, LENS),
        ("equal-area panorama", Projection::Spherical(SphereMap::EqualArea), PINHOLE),
        ("panorama", Projection::Spherical(SphereMap::LatitudeLongitude), PINHOLE),
    ];
    let places = [
        ("at rest", rest, rest),
        ("turned", turned, turned),
        ("moving", rest, turned),
        ("squeezed", squeezed, squeezed),
        ("sheared", sheared, sheared),
    ];
    let of = |(what, projection, lens)| {
        places.map(move |(how, start, end)| (format!("{what} {how}"), camera(projection, lens, &start, &end)))
    };
    projections.into_iter().flat_map(of).collect()
}

/// Cameras of every projection above a floor at y = −1, and the size of their film.
pub fn looking_at_the_floor() -> (Vec<(String, Camera)>, Vec2) {
    let above =
        Transform::look_at(Vec3::new(0.5, 2.0, -3.5), Vec3::new(0.0, -1.0, 0.5), Vec3::Y).expect("an up").inverse();
    let squeezed = above.compose(&Transform::scale(Vec3::new(1.3, 0.8, 1.6)).expect("a scale"));
    let moved = Transform::translate(Vec3::new(0.4, 0.2, 0.0)).compose(&above);
    let lens = Lens { radius: 0.3, focal_distance: 4.0 };
    let of = |name: &str, projection, lens, start, end| (name.to_string(), camera(projection, lens, start, end));
    let cameras = vec![
        of("perspective", Projection::Perspective, PINHOLE, &above, &moved),
        of("lens", Projection::Perspective, lens, &above, &squeezed),
        of("orthographic", Projection::Orthographic, PINHOLE, &squeezed, &squeezed),
        of("orthographic lens", Projection::Orthographic, lens, &above, &moved),
        of("equal-area panorama", Projection::Spherical(SphereMap::EqualArea), PINHOLE, &above, &moved),
        of("panorama", Projection::Spherical(SphereMap::LatitudeLongitude), PINHOLE, &squeezed, &squeezed),
    ];
    (cameras, size())
}

fn ends(camera: &Camera) -> [CameraEnd; 2] {
    [camera.sample_end(Vec2::new(0.2, 0.9), 0.4), camera.sample_end(Vec2::new(0.7, 0.35), 0.9)]
}

#[test]
fn rays_and_film_positions_invert_each_other() {
    for (name, camera) in cameras() {
        for i in 0..500 {
            let mut random = Random::new(1, 0, i);
            let (lens_u, time_u) = (random.next_2d(), random.next_1d());
            let end = camera.sample_end(lens_u, time_u);
            let film = random.next_2d() * size();
            let ray = camera.departure(&end, film);
            let known = camera.ray(film, lens_u, time_u);
            assert_eq!((ray.origin, ray.direction, ray.time), (known.origin, known.direction, known.time), "{name}");
            assert_eq!(end.time(), ray.time, "{name}");
            match end.place() {
                CameraPlace::Point(position) => assert_eq!(position, ray.origin, "{name}"),
                CameraPlace::Infinity(looking) => assert!(looking.distance(ray.direction) < 1e-5, "{name}"),
            }
            let from = ray.origin + ray.direction * (0.5 + 10.0 * random.next_1d());
            let (found, response) = camera.film(&end, from, 0.01).unwrap_or_else(|| panic!("{name}: {film}"));
            // Close to the poles of a panorama, pixels have no width.
            assert!(found.distance(film) < 5e-3 || response > 1e4, "{name}: {film} {found}");
            if !name.contains("panorama") {
                let behind = ray.origin - ray.direction * 0.5;
                assert_eq!(camera.film(&end, behind, 0.0), None, "{name}");
            }
        }
    }
}

/// Film positions drawn evenly send rays by the response, which therefore integrates to the number of pixels; up to a
/// factor that it is wrong by.
fn response(camera: &Camera, end: &CameraEnd, factor: f64) -> Chi2Result {
    const SAMPLES: u64 = 20_000;
    let pixels = f64::from(size().x * size().y);
    let at = |from: Vec3| camera.film(end, from, 0.0).map_or(1e-9, |(_, w)| factor * f64::from(w) / pixels);
    match end.place() {
        CameraPlace::Point(position) => chi2_sphere(
            |u| Some(camera.departure(end, u * size()).direction),
            |direction| at(position + 3.0 * direction),
            SAMPLES,
            2,
        ),
        CameraPlace::Infinity(looking) => {
            // On a plane before the camera, where it sees all of it.
            let frame = Frame::from_z(looking);
            let center = camera.departure(end, 0.5 * size());
            let middle = center.origin + looking * 20.0;
            let on_plane = |film| {
                let ray = camera.departure(end, film);
                let at = frame.to_local(ray.origin - middle);
                Vec2::new(at.x, at.y)
            };
            chi2_rectangle(
                |u| Some(on_plane(u * size())).filter(|p| p.abs().max_element() < 0.3),
                |p| at(middle + frame.s * p.x + frame.t * p.y),
                [-0.3, 0.3, -0.3, 0.3],
                [8, 8],
                SAMPLES,
                2,
            )
        }
    }
}

#[test]
fn the_response_is_the_density_of_the_film() {
    let cameras = cameras();
    let significance = sidak(SIGNIFICANCE, 2 * cameras.len());
    for (name, camera) in &cameras {
        let which = if name.contains("moving") || name.contains("lens") { 2 } else { 1 };
        for end in &ends(camera)[..which] {
            let result = response(camera, end, 1.0);
            assert!(result.passes(significance), "{name}: {result:?}");
        }
        // Of an orthographic camera, only a small part of the film is looked at.
        let wrong = if ends(camera)[0].is_infinite() { 1.4 } else { 1.04 };
        if name.contains("sheared") {
            assert!(!response(camera, &ends(camera)[0], wrong).passes(1e-6), "{name}: a wrong response");
        }
    }
}

/// The response of a camera that is squeezed is not that of one that is not.
#[test]
fn the_response_heeds_the_transform() {
    let squeezed = Transform::scale(Vec3::new(2.0, 1.0, 1.0)).expect("a scale");
    for projection in [Projection::Perspective, Projection::Orthographic] {
        let [plain, wide] = [Transform::IDENTITY, squeezed].map(|t| camera(projection, PINHOLE, &t, &t));
        let ahead = Vec3::new(0.0, 0.0, 2.0);
        let w = |camera: &Camera| camera.film(&ends(camera)[0], ahead, 0.0).map(|(_, w)| w).expect("in the middle");
        assert!((w(&plain) / w(&wide) - 2.0).abs() < 1e-4, "{projection:?}");
    }
}

/// A panorama goes on across its border: rays from beyond it are those of positions within.
#[test]
fn panoramas_repeat_beyond_their_border() {
    for map in [SphereMap::EqualArea, SphereMap::LatitudeLongitude] {
        let camera = camera(Projection::Spherical(map), PINHOLE, &Transform::IDENTITY, &Transform::IDENTITY);
        let end = ends(&camera)[0];
        let (mut beyond, mut repeated) = (0, 0);
        for i in 0..5000 {
            const MARGIN: f32 = 4.0;
            let film = Random::new(8, 0, i).next_2d() * (size() + 2.0 * MARGIN) - MARGIN;
            let ray = camera.departure(&end, film);
            let (within, _) = camera.film(&end, ray.origin + ray.direction, 0.0).expect("a panorama is whole");
            let near = |p: &Vec2| p.distance(film) < 0.02;
            let others = camera.repeated_films(within, MARGIN);
            let is_beyond = film.cmplt(Vec2::ZERO).any() || film.cmpgt(size()).any();
            let is_pole = camera.film(&end, ray.origin + ray.direction, 0.0).is_some_and(|(_, w)| w > 5e3);
            assert!(is_pole || others.iter().any(near) == is_beyond, "{map:?} {film} {within} {others:?}");
            for other in &others {
                let again = camera.departure(&end, *other).direction;
                assert!(again.distance(ray.direction) < 2e-3, "{map:?} {film} {other}");
            }
            beyond += i32::from(is_beyond);
            repeated += others.len();
        }
        assert!(beyond > 500 && repeated > 500);
        assert!(camera.repeated_films(0.5 * size(), 4.0).is_empty());
    }
}

#[test]
fn margins_widen_the_film() {
    for projection in [Projection::Perspective, Projection::Orthographic] {
        let camera = camera(projection, LENS, &Transform::IDENTITY, &Transform::IDENTITY);
        let end = ends(&camera)[1];
        for beyond in [Vec2::new(-1.5, 20.0), Vec2::new(30.0, 41.5)] {
            let ray = camera.departure(&end, beyond);
            let from = ray.origin + ray.direction * 3.0;
            assert!(camera.film(&end, from, 1.4).is_none());
            assert!(camera.film(&end, from, 1.6).is_some_and(|(film, _)| film.distance(beyond) < 1e-3));
        }
    }
}
