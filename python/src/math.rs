//! Functions of libm, which return the same bits on every machine. Those of Python's `math` depend on the machine.

use pyo3::prelude::*;

macro_rules! functions {
    ($($name:ident($($x:ident),+);)+) => {
        $(
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
    acos(x);
    asin(x);
    atan(x);
    atan2(y, x);
    cbrt(x);
    cos(x);
    cosh(x);
    exp(x);
    expm1(x);
    hypot(x, y);
    log(x);
    log10(x);
    log1p(x);
    log2(x);
    pow(x, y);
    sin(x);
    sinh(x);
    sqrt(x);
    tan(x);
    tanh(x);
}
