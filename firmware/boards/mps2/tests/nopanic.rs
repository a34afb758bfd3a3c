//! Links core, wire and app with a panic handler that does not exist: when any input can reach a
//! panic, this image does not link. It is never run.
//!
//! Every value passes through [`opaque`], so that the compiler knows nothing of it. What to do when
//! it fails stands in docs/results/cost.md.
#![no_std]
#![no_main]

#[path = "bare.rs"]
mod bare;

use backseat_app::parameters::{PARAMETERS, Settings};
use backseat_app::store::{
    CRASH_WORDS, Chip, CrashMemory, CrashSlot, ImageFlash, ParameterFlash, RestartRecord, forget_crashes, keep_crash,
    kept_crashes, newest, take_last_crash,
};
use backseat_app::{App, LocalFrame, Loss, Pump};
use backseat_core::control::allocation::{AllocationMethod, Datum, Moments, allocate};
use backseat_core::control::mission::{Lawnmower, Mission, Waypoint};
use backseat_core::control::riccati::RiccatiSolver;
use backseat_core::control::{ControlConfig, Controller};
use backseat_core::dynamics::{ActuatorInput, VehicleModel, VehicleParameters};
use backseat_core::identification::{IdentificationConfig, Identifier, theta};
use backseat_core::navigation::{
    Consistency, InitialShip, InitialState, Measurement, NavigationConfig, Navigator, ProcessModel, ProcessNoise,
    Sensor, nees_position, nees_vehicle,
};
use backseat_core::state::VehicleState;
use backseat_wire::abort::Abort;
use backseat_wire::ahrs::{gx3, mip, os5000::Os5000};
use backseat_wire::calendar::{Date, DateTime, TimeOfDay};
use backseat_wire::dvl::{DvlSample, pd0, pd4, pd6};
use backseat_wire::gps::{Gga, Rmc};
use backseat_wire::hostlink::{self, Crash, FromBoard, Port, ResetCause, ToBoard};
use backseat_wire::iver::servo::ServoCalibration;
use backseat_wire::iver::{FromFrontseat, ToFrontseat, Units};
use backseat_wire::modem::{ClockEncoding, ClockMode, DopplerSign, FromModem, ToModem};
use backseat_wire::nmea::{Checksum, Framer, MAX_SENTENCE, Sentence};
use backseat_wire::ship_state::{Key, ShipState};
use backseat_wire::{Decimal, hex};
use core::convert::Infallible;
use core::hint::black_box as opaque;
use core::panic::PanicInfo;
use cortex_m_rt::entry;
use embedded_io::{ErrorType, Read, ReadReady, Write, WriteReady};
use embedded_storage::nor_flash::{ErrorType as FlashErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use nalgebra::{SMatrix, Vector3, Vector6};
use static_cell::ConstStaticCell;

unsafe extern "C" {
    /// Defined nowhere.
    fn a_panic_can_be_reached() -> !;
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    // SAFETY: does not link.
    unsafe { a_panic_can_be_reached() }
}

/// The big ones.
struct Objects {
    app: App,
    pump: Pump,
    settings: Settings,
    navigator: Navigator,
    controller: Controller,
    solver: RiccatiSolver<12, 3>,
    identifier: Identifier,
}

/// In the larger RAM; what it holds at start does not matter here.
// SAFETY: nothing else is placed by this section's name.
#[unsafe(link_section = ".axisram.nopanic")]
static OBJECTS: ConstStaticCell<Objects> = ConstStaticCell::new(Objects {
    app: App::new(),
    pump: Pump::new(),
    settings: Settings::DEFAULT,
    navigator: Navigator::new(),
    controller: Controller::new(),
    solver: RiccatiSolver::new(),
    identifier: Identifier::new(),
});

#[entry]
fn main() -> ! {
    if let Some(objects) = OBJECTS.try_take() {
        loop {
            let objects = opaque(&mut *objects);
            app(objects);
            navigation(&mut objects.navigator);
            control(objects);
            identification(&mut objects.identifier);
            let bytes = opaque([0_u8; 64]);
            let length = opaque(0_usize);
            let bytes = bytes.get(..length).unwrap_or_default();
            sentences(bytes);
            frames(bytes);
            numbers(bytes);
        }
    }
    loop {
        cortex_m::asm::wfi();
    }
}

/// A port of which nothing is known.
struct AnyPort;

impl ErrorType for AnyPort {
    type Error = Infallible;
}

impl ReadReady for AnyPort {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(opaque(false))
    }
}

impl Read for AnyPort {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        opaque(&mut *buffer);
        Ok(opaque(0))
    }
}

impl WriteReady for AnyPort {
    fn write_ready(&mut self) -> Result<bool, Infallible> {
        Ok(opaque(false))
    }
}

impl Write for AnyPort {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        opaque(bytes);
        Ok(opaque(0))
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

/// Records of which nothing is known.
struct AnyCrashes;

impl CrashMemory for AnyCrashes {
    fn read(&self, slot: usize) -> CrashSlot {
        opaque(slot);
        opaque([0; CRASH_WORDS])
    }

    fn write(&mut self, slot: usize, words: &CrashSlot) {
        opaque((slot, words));
    }
}

/// A flash of which nothing is known.
struct AnyFlash;

impl FlashErrorType for AnyFlash {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for AnyFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, _: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        opaque(bytes);
        opaque(Ok(()))
    }

    fn capacity(&self) -> usize {
        opaque(0)
    }
}

impl NorFlash for AnyFlash {
    const WRITE_SIZE: usize = 32;
    const ERASE_SIZE: usize = 128 * 1024;

    fn erase(&mut self, _: u32, _: u32) -> Result<(), NorFlashErrorKind> {
        opaque(Ok(()))
    }

    fn write(&mut self, _: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        opaque(bytes);
        opaque(Ok(()))
    }
}

fn app(objects: &mut Objects) {
    let Objects { app, pump, settings, .. } = objects;
    let mut ports = [const { AnyPort }; 5];
    let Ok(progress) = pump.poll(app, &mut ports, opaque(0));
    opaque(progress);

    app.pps(opaque(0));
    app.step(opaque(0));
    for port in Port::ALL {
        opaque((app.transmit(port), app.waiting(port)));
        app.transmitted(port, opaque(0));
    }
    let health = app.health();
    opaque((health.dvl(), health.ahrs(), health.depth_m(), health.fix_m(), health.overflows()));
    opaque((health.late(), health.too_late(), health.odd_times(), health.lost_packets(opaque(Loss::Absurd))));
    opaque((health.accepted(opaque(Port::Dvl)), health.rejected(opaque(Port::Dvl)), health.unsent(opaque(Port::Dvl))));
    opaque((app.digest(), app.stepped_us(), app.is_under_way()));

    if let Ok(mut flash) = ParameterFlash::new(AnyFlash) {
        let found = flash.load(settings).is_ok();
        app.restore(found.then_some(&*settings));
        if let Some(settings) = app.to_store() {
            let kept = flash.save(settings).is_ok();
            app.stored(kept);
        }
    }
    let mut images = ImageFlash::new(AnyFlash, Chip { flash: opaque(0), stack: 0..opaque(0) }, opaque(0));
    opaque(images.start());
    app.set_images(images.report());
    if let Some(order) = app.to_update() {
        let outcome = order.carry_out(&mut images);
        app.updated(outcome, images.report());
    }
    let slots = opaque([[0_u8; 128]; 2]);
    let last = newest([&slots[0], &slots[1]]);
    let (response, record) = RestartRecord::respond(opaque(ResetCause::Watchdog), last.as_ref());
    keep_crash(&mut AnyCrashes, &opaque(Crash::at(opaque("main.rs"), 1)));
    app.earlier_crashes(&opaque(kept_crashes(&AnyCrashes)));
    app.resume(record.report(opaque(ResetCause::Watchdog), take_last_crash(&mut AnyCrashes)), &response);
    forget_crashes(&mut AnyCrashes);
    opaque(app.restart_record(&record, opaque(0)).encode());
    app.restart();
    for parameter in PARAMETERS {
        let value = parameter.get(settings);
        parameter.set(settings, opaque(value));
    }
}

fn navigation(navigator: &mut Navigator) {
    let config = opaque(NavigationConfig::REFERENCE);
    if let Ok(model) = VehicleModel::new(&opaque(VehicleParameters::IVER3)) {
        opaque(navigator.configure(&config, &model).is_ok());
    }
    opaque(navigator.reconfigure(&config).is_ok());
    let noise = opaque(ProcessNoise::DYNAMIC);
    opaque(navigator.set_process_model(opaque(ProcessModel::Dynamic), &noise).is_ok());
    let one = VehicleState::repeat(1.0);
    opaque(navigator.initialise(opaque(0), &opaque(InitialState { state: one, sigma: one })).is_ok());
    opaque(navigator.initialise_ship(&opaque(InitialShip { state: [0.0; 6], sigma: [1.0; 6] })).is_ok());
    let clones = [navigator.clone_vehicle(), navigator.clone_ship()];
    opaque(navigator.predict(opaque(0), &opaque(ActuatorInput::default())).is_ok());
    let mut consistency = Consistency::new();
    for record in navigator.fuse(&opaque(Measurement::Depth { z_m: 0.0 })).iter() {
        consistency.add(opaque(record));
    }
    opaque(consistency.tally(opaque(Sensor::Depth)).mean());
    for clone in clones.into_iter().filter_map(|clone| opaque(clone.ok())) {
        navigator.drop_clone(clone);
    }
    opaque((navigator.state_at(opaque(0)), navigator.covariance(opaque(0), opaque(0)), navigator.digest()));
    opaque((navigator.main().is_suspect(opaque(Sensor::Depth)), navigator.main().recoveries(opaque(Sensor::Depth))));
    opaque((navigator.main().ship_state(), navigator.main().current_sigma()));
    opaque((navigator.failure(), navigator.horizontal_sigma_m(), navigator.current(), navigator.variance(opaque(0))));
    let mut block = SMatrix::<f64, 12, 12>::zeros();
    navigator.vehicle_covariance(&mut block);
    opaque(nees_vehicle(&opaque(one), &opaque(block)));
    opaque(nees_position(opaque([0.0; 2]), opaque(1.0), opaque(0.0), opaque(1.0)));
}

fn control(objects: &mut Objects) {
    let Objects { controller, solver, .. } = objects;
    let Ok(model) = VehicleModel::new(&opaque(VehicleParameters::IVER3)) else { return };
    opaque(controller.configure(&opaque(ControlConfig::REFERENCE), &model).is_ok());
    let mut mission = Mission::new();
    opaque(mission.push(opaque(Waypoint { x_m: 0.0, y_m: 0.0, depth_m: 0.0, speed_mps: 1.0 })).is_ok());
    opaque(mission.push_lawnmower(&opaque(Lawnmower::REFERENCE)).is_ok());
    controller.set_mission(&mission);
    let x = opaque(VehicleState::zeros());
    opaque(controller.start(&x).is_ok());
    opaque(controller.command(opaque(0), &x, opaque([0.0; 2])));
    opaque((controller.status(), controller.mission().waypoints()));
    controller.stop();

    let velocity = backseat_core::state::velocity(&x);
    for method in [AllocationMethod::Decoupled, AllocationMethod::SixDof] {
        let datum = opaque(Datum::Total);
        opaque(allocate(method, &model, &velocity, &opaque(Moments::default()), &datum, opaque(0.3)));
    }
    opaque((
        model.derivative(&x, &opaque(ActuatorInput::default())),
        model.linearise(&x, &opaque(ActuatorInput::default())),
    ));
    opaque((
        model.input_jacobian(&x, &opaque(ActuatorInput::default())),
        model.actuator_regressor(&velocity, &opaque(ActuatorInput::default())),
    ));

    let (a, b) = opaque((SMatrix::<f64, 12, 12>::zeros(), SMatrix::<f64, 12, 3>::zeros()));
    let (q, r) = opaque((SMatrix::<f64, 12, 12>::zeros(), SMatrix::<f64, 3, 3>::identity()));
    *solver.matrices().0 = a;
    *solver.matrices().1 = q;
    opaque((solver.begin(&b, &r).is_ok(), solver.step().is_ok()));
    opaque(solver.cost());
    let mut gain = SMatrix::<f64, 3, 12>::zeros();
    solver.gain_to(&mut gain);
    opaque(&gain);
}

fn identification(identifier: &mut Identifier) {
    let prior = opaque(VehicleParameters::IVER3);
    opaque(identifier.configure(&opaque(IdentificationConfig::DEFAULT), &prior).is_ok());
    let (attitude, velocity) = opaque((Vector3::zeros(), Vector6::zeros()));
    let input = opaque(ActuatorInput::default());
    opaque(identifier.sample(opaque(0), &attitude, &velocity, &input));
    opaque((identifier.excitation(), identifier.drift().drifted(), identifier.drift().scores()));
    opaque((identifier.state(), identifier.parameters(), identifier.adapted_s(), identifier.restarts()));
    if let Some(estimate) = identifier.estimate() {
        opaque(theta::theta_of(&theta::with_theta(&prior, &opaque(estimate))));
    }
}

fn sentences(bytes: &[u8]) {
    let mut buffer = [0; MAX_SENTENCE];
    let mut framer = Framer::new(opaque(Checksum::Required));
    let mut rest = bytes;
    while let Some(outcome) = framer.feed(&mut rest) {
        if let Ok(sentence) = outcome {
            sentence_of_any_device(&sentence, &mut buffer);
        }
    }
    opaque(framer.counts());
    if let Ok(sentence) = Sentence::from_line(bytes, opaque(Checksum::Optional)) {
        sentence_of_any_device(&sentence, &mut buffer);
    }
}

fn sentence_of_any_device(sentence: &Sentence<'_>, buffer: &mut [u8]) {
    let units = opaque(Units::remote_helm(opaque(5)));
    if let Ok(message) = FromFrontseat::parse(sentence, &units) {
        opaque(opaque(message).emit(&units, buffer).is_ok());
    }
    if let Ok(message) = ToFrontseat::parse(sentence, &units) {
        opaque(opaque(message).emit(&units, buffer).is_ok());
    }
    if let Ok(message) = FromModem::parse(sentence) {
        if let FromModem::Statistics(statistics) = &message {
            opaque(statistics.arrival.unix_us(opaque(0)));
        }
        opaque(opaque(message).emit(buffer).is_ok());
    }
    if let Ok(message) = ToModem::parse(sentence) {
        opaque(opaque(message).emit(buffer).is_ok());
    }
    if let Ok(sample) = Os5000::parse(sentence) {
        opaque(sample.sample());
        opaque(opaque(sample).emit(buffer).is_ok());
    }
    if let Ok(fix) = Rmc::parse(sentence) {
        opaque(opaque(fix).emit(buffer).is_ok());
    }
    if let Ok(fix) = Gga::parse(sentence) {
        opaque(opaque(fix).emit(buffer).is_ok());
    }
}

fn frames(bytes: &[u8]) {
    let mut buffer = [0; hostlink::MAX_FRAME];
    let mounting_rad = opaque(0.0);
    let sample = opaque(DvlSample::default());
    let mut rest = bytes;
    let mut decoder = pd0::Decoder::new();
    while let Some(outcome) = decoder.feed(&mut rest) {
        opaque(outcome.map(|ensemble| ensemble.sample(mounting_rad)).is_ok());
    }
    opaque(opaque(pd0::Ensemble::from_sample(&sample, opaque(0), mounting_rad)).emit(&mut buffer).is_ok());
    let (mut decoder, mut rest) = (pd4::Decoder::new(), bytes);
    while let Some(outcome) = decoder.feed(&mut rest) {
        opaque(outcome.map(|record| record.sample(mounting_rad)).is_ok());
    }
    opaque(opaque(pd4::Record::from_sample(&sample, opaque(true), mounting_rad)).emit(&mut buffer).is_ok());
    let (mut decoder, mut rest) = (pd6::Decoder::new(mounting_rad), bytes);
    while let Some(outcome) = decoder.feed(&mut rest) {
        opaque(outcome.is_ok());
    }
    opaque(pd6::emit(&sample, mounting_rad, &mut buffer).is_ok());
    let (mut decoder, mut rest) = (gx3::Decoder::new(), bytes);
    while let Some(outcome) = decoder.feed(&mut rest) {
        opaque(outcome.is_ok());
    }
    opaque(opaque(gx3::Reply::euler_rate(opaque([0.0; 3]), opaque([0.0; 3]), opaque(0))).emit(&mut buffer).is_ok());
    if let Ok(Some((command, _))) = gx3::ToGx3::parse(bytes) {
        opaque(opaque(command).emit(&mut buffer).is_ok());
    }
    let (mut decoder, mut rest) = (mip::Decoder::new(), bytes);
    while let Some(outcome) = decoder.feed(&mut rest) {
        if let Ok(packet) = outcome {
            if let Ok(Some(sample)) = packet.sample() {
                opaque(mip::emit_sample(&opaque(sample), &mut [0; 256]).is_ok());
            }
            opaque(packet.fields().count());
        }
    }
    opaque(mip::emit_format(opaque(1), &mut buffer).is_ok());
    opaque(mip::emit_stream(opaque(true), &mut buffer).is_ok());
    if let Ok(ship) = ShipState::parse(bytes) {
        opaque(opaque(ship).emit().is_ok());
    }
    if let Ok(abort) = Abort::parse_authentic(bytes, &opaque(Key::new([1; 16]))) {
        opaque(opaque(abort).emit_authentic(&opaque(Key::new([2; 16]))).is_ok());
    }
    host_frames(bytes, &mut buffer);
}

fn host_frames(bytes: &[u8], buffer: &mut [u8]) {
    let (mut decoder, mut rest) = (hostlink::Decoder::new(), bytes);
    while let Some(outcome) = decoder.feed(&mut rest) {
        let Ok(frame) = outcome else { continue };
        if let Ok(message) = frame.message::<ToBoard<'_>>() {
            opaque(hostlink::encode(&opaque(message), buffer).is_ok());
        }
        if let Ok(message) = frame.message::<FromBoard<'_>>() {
            opaque(hostlink::encode(&opaque(message), buffer).is_ok());
        }
    }
    opaque(decoder.counts());
}

fn numbers(bytes: &[u8]) {
    if let Ok(decimal) = Decimal::parse(bytes) {
        opaque((decimal.to_f64(), decimal.unit(), decimal.rescaled(opaque(3))));
    }
    opaque(Decimal::from_f64(opaque(0.0), opaque(3)).is_ok());
    opaque(hex::decode_exact(bytes, &mut [0; 8]).is_ok());
    if let Ok(time) = TimeOfDay::parse(bytes) {
        opaque((time.parts(), time.nearest(opaque(0))));
    }
    opaque(Date::new(opaque(0), opaque(0), opaque(0)).map(|date| (date.days(), date.parts())).is_ok());
    opaque(DateTime::from_unix_us(opaque(0)).map(DateTime::unix_us).is_ok());
    let clock = opaque(ClockMode(0));
    opaque((
        clock.is_synchronous(opaque(ClockEncoding::Legacy)),
        opaque(DopplerSign::ClosingPositive).range_rate_mps(opaque(0.0)),
    ));
    let calibration = opaque(ServoCalibration::NOMINAL);
    let servo = opaque(calibration.bytes(opaque([0.0; 4]), opaque(0.0)));
    opaque((calibration.fins_rad(&servo), calibration.propeller_radps(&servo)));
    let frame = LocalFrame::new(opaque(0.0), opaque(0.0));
    opaque((frame.to_local(opaque(0.0), opaque(0.0)), frame.to_geodetic(opaque([0.0; 2]))));
}
