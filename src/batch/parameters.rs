//! [`Parameters`]: the parameters of a batch's points.

use std::sync::{Arc, LazyLock};

/// The parameters of all points: given, or computed when they are first asked for.
///
/// Parameters of samples are computed: few who take samples ask for them, and they are a third of the bytes.
#[derive(Clone, Debug)]
pub(crate) struct Parameters(Arc<LazyLock<Arc<Vec<f64>>, Compute>>);

/// Computes all parameters.
type Compute = Box<dyn FnOnce() -> Arc<Vec<f64>> + Send>;

impl Parameters {
    /// Parameters that are computed later.
    pub fn later(compute: impl FnOnce() -> Vec<f64> + Send + 'static) -> Self {
        Parameters(Arc::new(LazyLock::new(Box::new(|| Arc::new(compute())))))
    }

    /// All parameters.
    pub fn get(&self) -> &Arc<Vec<f64>> {
        &self.0
    }

    /// All parameters as a vector.
    pub fn into_vec(self) -> Vec<f64> {
        self.get().to_vec()
    }
}

impl From<Vec<f64>> for Parameters {
    fn from(parameters: Vec<f64>) -> Self {
        Parameters::later(|| parameters)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_are_computed_once_and_shared_by_clones() {
        let later = Parameters::later(|| vec![0.5, 1.5]);
        let clone = later.clone();
        assert_eq!(**later.get(), [0.5, 1.5]);
        assert!(Arc::ptr_eq(later.get(), clone.get()));
    }
}
