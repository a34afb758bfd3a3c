//! Every protocol against the vectors (`../vectors`, see the README there), literal bytes, and hostile input.

mod abort;
mod hostlink;
mod val_dvl;
mod val_gps;
mod val_gx3;
mod val_iver;
mod val_mip;
mod val_modem;
mod val_os5000;

mod parts;
mod properties;
#[path = "../../../tests/random.rs"]
mod random;
mod ship_state;
mod soak;
mod vectors;
