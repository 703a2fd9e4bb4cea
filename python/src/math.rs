//! Functions of libm, which return the same bits on every machine. Those of Python's `math` depend on the machine.

use pyo3::prelude::*;

macro_rules! functions {
    ($($(#[$doc:meta])* $name:ident($($x:ident),+);)+) => {
        $(
            $(#[$doc])*
            #[pyfunction]
            fn $name($($x: f64),+) -> f64 {
                libm::$name($($x),+)
            }
        )+

        /// Adds the functions to a module.
        pub fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
            $(module.add_function(wrap_pyfunction!($name, module)?)?;)+
            Ok(())
        }
    };
}

functions! {
    /// Returns the arc cosine of x, rad, from 0 to pi.
    acos(x);
    /// Returns the arc sine of x, rad, from -pi/2 to pi/2.
    asin(x);
    /// Returns the arc tangent of x, rad, from -pi/2 to pi/2.
    atan(x);
    /// Returns the angle of the vector (x, y), rad, from -pi to pi.
    atan2(y, x);
    /// Returns the cube root of x.
    cbrt(x);
    /// Returns the cosine of x, rad.
    cos(x);
    /// Returns the hyperbolic cosine of x.
    cosh(x);
    /// Returns e to the power of x.
    exp(x);
    /// Returns e to the power of x, less 1, exact also near 0.
    expm1(x);
    /// Returns the length of the vector (x, y).
    hypot(x, y);
    /// Returns the natural logarithm of x.
    log(x);
    /// Returns the logarithm of x to the base of 10.
    log10(x);
    /// Returns the natural logarithm of 1 + x, exact also near 0.
    log1p(x);
    /// Returns the logarithm of x to the base of 2.
    log2(x);
    /// Returns x to the power of y.
    pow(x, y);
    /// Returns the sine of x, rad.
    sin(x);
    /// Returns the hyperbolic sine of x.
    sinh(x);
    /// Returns the square root of x.
    sqrt(x);
    /// Returns the tangent of x, rad.
    tan(x);
    /// Returns the hyperbolic tangent of x.
    tanh(x);
}
