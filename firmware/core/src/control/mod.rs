//! Trackline following: guidance, PD and LQR, fin allocation, speed, mission sequencing.
