//! The declaration of an allocator's parameters.

/// Declares the parameters of an allocator as a struct, with its default and its
/// [`parameters`](crate::allocator::Allocator::parameters). Each line has the key, the type, the default, the unit, the
/// range and the meaning. A default that is not a number or a flag is followed by `=>` and its word in scenarios.
macro_rules! parameters {
    (@default $type:ty, $default:expr => $word:literal) => {
        scenario::ParameterDefault::Text($word)
    };
    (@default $type:ty, $default:expr) => {{
        let default: $type = $default;
        scenario::ParameterDefault::from(default)
    }};
    (
        $(#[$about_all:meta])*
        pub struct $name:ident {
            $($key:ident: $type:ty = $default:expr $(=> $word:literal)?, $unit:literal, $range:expr, $about:literal;)*
        }
    ) => {
        $(#[$about_all])*
        #[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize)]
        #[serde(default, deny_unknown_fields)]
        pub struct $name {
            $(#[doc = $about] pub $key: $type,)*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($key: $default,)* }
            }
        }

        impl $name {
            /// Returns the parameters with unit, default, meaning and range.
            pub(crate) fn parameters() -> Vec<scenario::ParameterSpec> {
                vec![$(scenario::ParameterSpec::new(
                    stringify!($key),
                    $unit,
                    parameters!(@default $type, $default $(=> $word)?),
                    $about,
                    $range,
                ),)*]
            }
        }
    };
}

pub(crate) use parameters;
