//! Speeds along paths.

use clap::Args;
use faircurve::tracks::Vehicle;

/// What a vehicle can do.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Drives")]
pub struct DriveArgs {
    /// The fastest drive along each path, no faster than V: times t, and columns v, a_long and a_lat
    ///
    /// In units of the input by a unit of time. Open paths begin and end at rest. Points whose entry in a
    /// column stop is not 0 or blank are stops, which are written. A column max_speed has the largest speeds from points to the
    /// next.
    #[arg(long, value_name = "V", requires_all = ["lateral", "accelerate", "brake"], conflicts_with_all = ["every", "at", "write"], allow_negative_numbers = true)]
    speed: Option<f64>,
    /// The largest acceleration across the path, v² times its curvature
    #[arg(long, value_name = "A", requires = "speed", allow_negative_numbers = true)]
    lateral: Option<f64>,
    /// The largest acceleration along the path
    #[arg(long, value_name = "A", requires = "speed", allow_negative_numbers = true)]
    accelerate: Option<f64>,
    /// The largest deceleration along the path
    #[arg(long, value_name = "A", requires = "speed", allow_negative_numbers = true)]
    brake: Option<f64>,
    /// The largest change of the acceleration along the path in a unit of time
    #[arg(long, value_name = "J", requires = "speed", allow_negative_numbers = true)]
    jerk: Option<f64>,
}

impl DriveArgs {
    /// The vehicle, if a drive is asked for.
    pub fn vehicle(&self) -> Option<Vehicle> {
        let DriveArgs { speed, lateral, accelerate, brake, jerk } = *self;
        Some(Vehicle { speed: speed?, lateral: lateral?, accelerate: accelerate?, brake: brake?, jerk })
    }
}
