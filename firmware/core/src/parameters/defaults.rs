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

/// A struct, a constant of it, and its rows of the table of parameters ([`crate::row`]): name, unit, range, meaning and
/// default of a field are stated once, and what it means to people documents it.
///
/// `[ROW] "help" field: type = default` is a field with its row, `; [A, B]` behind it what a `choice` chooses from;
/// `[ROW] "help" (path)` is the row of a number in a part of the struct. Parts, and what is in no list, stand behind
/// `with`.
#[macro_export]
macro_rules! declared {
    ($(#[$about:meta])* pub struct $name:ident;
    $(#[$of_constant:meta])* const $constant:ident $(, with {
        $($(#[$doc:meta])* $part:ident: $part_type:ty = $part_default:expr,)*
    })?;
    $(#[$of_rows:meta])* const $rows:ident {
        $($row:tt $help:literal $(($($path:tt)+))? $($field:ident: $type:ty = $default:expr $(; $choices:tt)?)?,)*
    }) => {
        $(#[$about])*
        pub struct $name {
            $($($(#[$doc])* pub $part: $part_type,)*)?
            $($(#[doc = $help] pub $field: $type,)?)*
        }

        impl $name {
            $(#[$of_constant])*
            pub const $constant: Self = Self { $($($part: $part_default,)*)? $($($field: $default,)?)* };
            $(#[$of_rows])*
            pub const $rows: &[$crate::parameters::Row<Self>] = &[
                $($($crate::row!($row $help, $field $(, $choices)?),)? $($crate::row!($row $help, $($path)+),)?)*
            ];
        }
    };
}
