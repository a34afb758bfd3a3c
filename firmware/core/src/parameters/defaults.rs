//! Structs of settings whose fields state their defaults.

/// A struct with a constant of it: each field with its value in the constant.
#[macro_export]
macro_rules! with_defaults {
    ($(#[$about:meta])* pub struct $name:ident; $(#[$of_constant:meta])* const $constant:ident {
        $($(#[$doc:meta])* $field:ident: $type:ty = $default:expr,)*
    }) => {
        $(#[$about])*
        pub struct $name {
            $($(#[$doc])* pub $field: $type,)*
        }

        impl $name {
            $(#[$of_constant])*
            pub const $constant: Self = Self { $($field: $default,)* };
        }
    };
}
