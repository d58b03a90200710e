//! The kernels against their twins in single precision; host structs; divisions of the work.
