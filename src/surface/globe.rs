//! [`Globe`]: longitudes and latitudes.

use glam::{DMat3, DVec3};
use libm::{asinh, atan, atan2, atanh, cosh, exp, hypot, sincos, tanh};

use super::quadric::positive;
use super::{Kind, Quadric, Surface};
use crate::error::Result;

/// A sphere or a spheroid on which points are longitudes and latitudes in degrees.
///
/// Latitudes are geodetic: the angle of the normal with the plane of the equator. On a sphere that
/// is the angle at the centre. Heights are along the normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Globe {
    /// The radius of the equator.
    pub equatorial: f64,
    /// The distance of the poles from the centre.
    pub polar: f64,
}

/// Steps that find a latitude from an isometric one. On the Earth three are enough.
const ROUNDS: usize = 8;

impl Globe {
    /// The ellipsoid of the World Geodetic System 1984, in metres.
    pub const WGS84: Globe = Globe { equatorial: 6_378_137.0, polar: 6_356_752.314_245_179 };

    /// The mean radius (2a + b)/3 of the Earth, in metres.
    pub const EARTH: f64 = 6_371_008.771_4;

    /// The sphere of a radius.
    ///
    /// # Errors
    /// A radius that is not positive and finite.
    pub fn sphere(radius: f64) -> Result<Self> {
        positive("radius", "sphere", radius)?;
        Ok(Globe { equatorial: radius, polar: radius })
    }

    /// The surface.
    pub fn surface(&self) -> Quadric {
        Quadric { name: self.name(), ..self.nameless() }
    }

    /// The surface without a name, which takes time to format.
    fn nameless(&self) -> Quadric {
        let name = String::new();
        match *self {
            Globe { equatorial, polar } if equatorial == polar => Quadric::round(equatorial, name),
            Globe { equatorial, polar } => Quadric::axial(DVec3::new(equatorial, equatorial, polar), name),
        }
    }

    /// The place of a longitude and a latitude, in degrees, in space: x towards (0°, 0°), z towards
    /// the north pole.
    pub fn place(&self, longitude: f64, latitude: f64) -> DVec3 {
        let [(sin_lon, cos_lon), (sin_lat, cos_lat)] = [longitude, latitude].map(sin_cos_of_degrees);
        // N = a²/√(a² cos²φ + b² sin²φ)
        let (a, b) = (self.equatorial, self.polar);
        let (across, along) = (a * cos_lat, b * sin_lat);
        let root = hypot(across, along);
        DVec3::new(a * across * cos_lon, a * across * sin_lon, b * along) / root
    }

    /// The square of the eccentricity, negative if the poles are farther than the equator.
    pub(crate) fn eccentricity(&self) -> f64 {
        (self.equatorial - self.polar) * (self.equatorial + self.polar) / self.equatorial.powi(2)
    }

    /// e atanh(e sin φ), by which isometric latitudes on the ellipsoid and on a sphere differ.
    fn flattening(&self, sin: f64) -> f64 {
        let square = self.eccentricity();
        let e = square.abs().sqrt();
        if square >= 0.0 { e * atanh(e * sin) } else { -e * atan(e * sin) }
    }

    /// The point of the unit sphere of a place, under the conformal map of the globe, and the length on
    /// the globe of a unit of the sphere there.
    pub(crate) fn onto_sphere(&self, place: DVec3) -> (DVec3, f64) {
        let (a, b) = (self.equatorial, self.polar);
        let across = hypot(place.x, place.y);
        let (sin, cos) = (place.z * (a / b), across * (b / a));
        let (sin, cos) = (sin / hypot(sin, cos), cos / hypot(sin, cos));
        let isometric = asinh(sin / cos) - self.flattening(sin);
        let (out, height) = (1.0 / cosh(isometric), tanh(isometric));
        let east = if across > 0.0 { DVec3::new(place.x, place.y, 0.0) / across } else { DVec3::X };
        (east * out + DVec3::Z * height, self.scale(sin, cos))
    }

    /// The place of a point of the unit sphere, and the velocity there of one on the sphere.
    pub(crate) fn place_of(&self, point: DVec3, velocity: DVec3) -> (DVec3, DVec3) {
        let across = hypot(point.x, point.y);
        let out = if across > 0.0 { DVec3::new(point.x, point.y, 0.0) / across } else { DVec3::X };
        let isometric = asinh(point.z / across);
        // Newton's method for the isometric latitude of a sphere with the same latitude.
        let (mut own, square) = (isometric, self.eccentricity());
        for _ in 0..ROUNDS {
            let sin = tanh(own);
            let step = (own - self.flattening(sin) - isometric) * (1.0 - square * sin * sin) / (1.0 - square);
            own -= if step.is_finite() { step } else { 0.0 };
        }
        let (sin, cos) = (tanh(own), 1.0 / cosh(own));
        let (a, b) = (self.equatorial, self.polar);
        let root = hypot(a * cos, b * sin);
        let place = out * (a * (a * cos / root)) + DVec3::Z * (b * (b * sin / root));
        let east = DVec3::new(-out.y, out.x, 0.0);
        let [north_there, north] = [(point.z, across), (sin, cos)].map(|(sin, cos)| DVec3::Z * cos - out * sin);
        let scale = self.scale(sin, cos);
        (place, (east * velocity.dot(east) + north * velocity.dot(north_there)) * scale)
    }

    /// The scale of the conformal map at a latitude: N cos φ / cos χ, with cos φ and cos χ of isometric
    /// latitudes that differ by the flattening.
    fn scale(&self, sin: f64, cos: f64) -> f64 {
        let a = self.equatorial;
        let (c, twice) = (self.flattening(sin.abs()), -2.0 * asinh(sin.abs() / cos));
        let root = hypot(a * cos, self.polar * sin);
        a * (a / root) * (exp(-c) + exp(c + twice)) / (1.0 + exp(twice))
    }

    /// The unit vectors to the east and to the north at a longitude and a latitude, in degrees.
    pub fn compass(&self, longitude: f64, latitude: f64) -> [DVec3; 2] {
        let [(sin_lon, cos_lon), (sin_lat, cos_lat)] = [longitude, latitude].map(sin_cos_of_degrees);
        [DVec3::new(-sin_lon, cos_lon, 0.0), DVec3::new(-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat)]
    }

    /// √(a² cos²φ + b² sin²φ) = a²/N, and the radius M = a²b²/(a² cos²φ + b² sin²φ)^3/2 of a
    /// meridian.
    fn meridian(&self, sin: f64, cos: f64) -> [f64; 2] {
        let (a, b) = (self.equatorial, self.polar);
        let root = hypot(a * cos, b * sin);
        [root, (a / root) * (b / root) * (a / root) * b]
    }

    /// The velocities to the east and to the north for rates of longitude and latitude in degrees.
    ///
    /// Along the parallel the radius is N cos φ, and along the meridian M.
    pub(crate) fn ground_velocity(&self, latitude: f64, rates: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = sin_cos_of_degrees(latitude);
        let [root, radius] = self.meridian(sin, cos);
        let a = self.equatorial;
        [rates[0].to_radians() * (a * (a * cos / root)), rates[1].to_radians() * radius]
    }

    /// The velocity to the east, to the north and up of a point of a longitude, a latitude and a
    /// height whose coordinates change at these rates.
    pub(crate) fn motion(&self, point: DVec3, rates: DVec3) -> DVec3 {
        let [east, north] = self.ground_velocity(point.y, [rates.x, rates.y]);
        DVec3::new(east, north, rates.z)
    }

    /// The curvature within the surface of a curve of longitudes and latitudes with these
    /// derivatives, positive where it turns left as seen from above: 0 of a geodesic. Heights do
    /// not count.
    ///
    /// κ = (α′ + λ′ sin φ)/v with the angle α from the east to the motion, α′ = (e n′ − n e′)/v²
    /// (Liouville).
    pub(crate) fn curvature(&self, point: DVec3, first: DVec3, second: DVec3) -> f64 {
        let (sin, cos) = sin_cos_of_degrees(point.y);
        let (a, b) = (self.equatorial, self.polar);
        let rates = [first.x.to_radians(), first.y.to_radians()];
        let [east, north] = self.ground_velocity(point.y, [first.x, first.y]);
        let [eastward, northward] = self.ground_velocity(point.y, [second.x, second.y]);
        // M, and its derivative by the latitude.
        let [root, radius] = self.meridian(sin, cos);
        let radius_change = 3.0 * radius * (a - b) * (a + b) * sin * cos / (root * root);
        let east_change = eastward - radius * sin * rates[1] * rates[0];
        let north_change = northward + radius_change * rates[1] * rates[1];
        let speed = hypot(east, north);
        if speed == 0.0 {
            return 0.0;
        }
        let turn = (east / speed * north_change - north / speed * east_change) / speed;
        (turn + rates[0] * sin) / speed
    }

    /// The curvature in space of a curve of longitudes and latitudes: κ² = κ_g² + κ_n², κ_n = (e²/N
    /// + n²/M)/v² by Euler.
    pub(crate) fn curvature_in_space(&self, point: DVec3, first: DVec3, second: DVec3) -> f64 {
        let (sin, cos) = sin_cos_of_degrees(point.y);
        let [east, north] = self.ground_velocity(point.y, [first.x, first.y]);
        let speed = hypot(east, north);
        if speed == 0.0 {
            return 0.0;
        }
        let [root, radius] = self.meridian(sin, cos);
        let (e, n, across) = (east / speed, north / speed, self.equatorial * (self.equatorial / root));
        hypot(self.curvature(point, first, second), e * e / across + n * n / radius)
    }

    /// The velocity in space for rates of longitude and latitude in degrees.
    pub(crate) fn velocity(&self, [longitude, latitude]: [f64; 2], rates: [f64; 2]) -> DVec3 {
        let [east, north] = self.compass(longitude, latitude);
        let [eastward, northward] = self.ground_velocity(latitude, rates);
        eastward * east + northward * north
    }

    /// The longitude, from −180° to 180°, and the latitude of a place on the surface. The longitude
    /// of a pole is 0.
    pub fn angles(&self, place: DVec3) -> [f64; 2] {
        let (a, b) = (self.equatorial, self.polar);
        let out = hypot(place.x, place.y);
        let longitude = if out == 0.0 { 0.0 } else { atan2(place.y, place.x) };
        // The normal of the spheroid at a place of it is along (x/a², y/a², z/b²).
        [longitude.to_degrees(), atan2(a / b * (a / b) * place.z, out).to_degrees()]
    }
}

/// Its [quadric](Globe::surface)'s.
impl Surface for Globe {
    fn name(&self) -> String {
        let Globe { equatorial, polar } = *self;
        match *self {
            Globe::WGS84 => "the ellipsoid of WGS84".into(),
            _ if equatorial == polar => Quadric::sphere(equatorial).name,
            _ => Quadric::spheroid(equatorial, polar).name,
        }
    }

    fn value(&self, x: DVec3) -> f64 {
        self.nameless().value(x)
    }

    fn gradient(&self, x: DVec3) -> DVec3 {
        self.nameless().gradient(x)
    }

    fn hessian(&self, x: DVec3) -> DMat3 {
        self.nameless().hessian(x)
    }

    fn project(&self, x: DVec3) -> Option<DVec3> {
        self.nameless().project(x)
    }

    fn project_all(&self, points: &mut [DVec3]) {
        self.nameless().project_all(points);
    }

    fn kind(&self) -> Kind {
        Kind::Globe(*self)
    }
}

/// Sine and cosine of degrees, exact at multiples of 90°.
fn sin_cos_of_degrees(degrees: f64) -> (f64, f64) {
    let quarters = (degrees / 90.0).round();
    let (sin, cos) = sincos((degrees - 90.0 * quarters).to_radians());
    match quarters.rem_euclid(4.0) as u8 {
        0 => (sin, cos),
        1 => (cos, -sin),
        // 0 and not −0, so that 180° does not become −180°.
        2 => (0.0 - sin, -cos),
        _ => (-cos, sin),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_lie_on_the_surface_and_lead_back_to_their_angles() {
        for globe in [Globe::sphere(3.0).unwrap(), Globe::WGS84] {
            let surface = globe.surface();
            for (longitude, latitude) in [(0.0, 0.0), (180.0, -30.0), (-179.5, 89.9), (13.4, 52.5), (-90.0, 45.0)] {
                let place = globe.place(longitude, latitude);
                let height = surface.value(place) / surface.gradient(place).length();
                assert!(height.abs() < 4e-16 * globe.equatorial, "{height}");
                let [lon, lat] = globe.angles(place);
                assert!((lon - longitude).abs() < 1e-12 && (lat - latitude).abs() < 1e-13, "{lon} {lat}");
            }
            assert_eq!(globe.place(77.0, 90.0), DVec3::new(0.0, 0.0, globe.polar));
            assert_eq!(globe.angles(DVec3::new(0.0, 0.0, -globe.polar)), [0.0, -90.0]);
        }
    }

    #[test]
    fn velocities_are_differences_of_places() {
        for globe in [Globe::sphere(3.0).unwrap(), Globe::WGS84] {
            for (longitude, latitude) in [(0.0, 0.0), (180.0, -30.0), (13.4, 52.5), (-90.0, 89.0), (20.0, 90.0)] {
                for rates in [[1.0, 0.0], [0.0, 1.0], [-2.0, 3.0]] {
                    let h = 1e-4;
                    let [before, after] =
                        [-h, h].map(|h| globe.place(longitude + h * rates[0], latitude + h * rates[1]));
                    let error = globe.velocity([longitude, latitude], rates).distance((after - before) / (2.0 * h));
                    assert!(error < 1e-9 * globe.equatorial, "{longitude} {latitude} {rates:?}: {error:e}");
                }
            }
        }
    }

    #[test]
    fn latitudes_of_wgs84_are_geodetic() {
        // By N = a/√(1 − e² sin²φ) and z = N (1 − e²) sin φ.
        let place = Globe::WGS84.place(13.4, 52.5);
        let wanted = DVec3::new(3785041.526193605, 901724.084635326, 5036864.5848322);
        assert!((place - wanted).length() < 1e-8, "{place}");
        let normal = crate::surface::normal(&Globe::WGS84.surface(), place);
        assert!((normal.z.asin().to_degrees() - 52.5).abs() < 1e-12);
    }
}
