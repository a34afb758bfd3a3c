//! Requests to renew the board's firmware: the app decides whether, the board does it
//! ([`store::ImageFlash`](crate::store::ImageFlash)).

use crate::app::App;
use crate::backseat::Backseat;
use crate::held::Held;
use crate::host::send;
use crate::store::ImageFlash;
use backseat_wire::hostlink::{FromBoard, Image, Images, Refusal, ToBoard, UPDATE_CHUNK};
use embedded_storage::nor_flash::NorFlash;
use heapless::Vec;

/// What the board is to do with its images.
#[expect(clippy::large_enum_variant, reason = "there is no allocator to box the large one")]
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Order {
    /// An image comes next.
    Begin(Image),
    /// The next bytes of it.
    Write {
        /// Their place, from 0.
        offset: u32,
        /// The bytes.
        bytes: Vec<u8, UPDATE_CHUNK>,
    },
    /// All have come; if that succeeds, the board exchanges its banks and resets.
    Commit,
    /// The image that runs stays.
    Confirm,
}

impl Order {
    /// Of a request.
    ///
    /// # Errors
    /// Too many bytes at once, or no request of this kind.
    fn of(request: &ToBoard<'_>) -> Result<Self, Refusal> {
        Ok(match *request {
            ToBoard::UpdateBegin(image) => Self::Begin(image),
            ToBoard::UpdateWrite { offset, bytes } => {
                Self::Write { offset, bytes: Vec::from_slice(bytes).map_err(|_| Refusal::OutOfRange)? }
            }
            ToBoard::UpdateCommit => Self::Commit,
            ToBoard::UpdateConfirm => Self::Confirm,
            _ => return Err(Refusal::Sequence),
        })
    }

    /// Does it.
    ///
    /// # Errors
    /// Those of the flash.
    pub fn carry_out<F: NorFlash>(&self, images: &mut ImageFlash<F>) -> Result<(), Refusal> {
        match self {
            Self::Begin(image) => images.begin(*image),
            Self::Write { offset, bytes } => images.write(*offset, bytes),
            Self::Commit => images.commit(),
            Self::Confirm => images.confirm(),
        }
    }
}

/// The board's images, as the app sees them.
#[derive(Debug)]
pub struct Updates {
    /// None: this board has no second bank.
    images: Held<Images>,
    /// Until the board has done it.
    order: Held<Order>,
}

impl Updates {
    pub const fn new() -> Self {
        Self { images: Held::none(), order: Held::none() }
    }

    pub fn images(&self) -> Option<&Images> {
        self.images.get()
    }

    pub fn is_busy(&self) -> bool {
        self.order.get().is_some()
    }

    /// The image that runs may yet be taken back.
    pub fn is_on_trial(&self) -> bool {
        self.images.get().is_some_and(|images| images.trial.is_some())
    }
}

/// Has the board carry it out; answered when that is done. At rest alone: flash is written, and the last of it resets
/// the board.
#[inline(never)] // its bytes are not to stay on the stack
pub fn ask(backseat: &mut Backseat, request: &ToBoard<'_>) -> Result<(), Refusal> {
    if backseat.steering.is_engaged() {
        return Err(Refusal::UnderWay);
    }
    if backseat.updates.images().is_none() {
        return Err(Refusal::NoStore);
    }
    if !backseat.is_still() {
        return Err(Refusal::NotReady);
    }
    backseat.updates.order.set(Order::of(request)?);
    Ok(())
}

impl App {
    /// The board has two banks, and this is what is in them: at start, and after each order.
    pub fn set_images(&mut self, images: Images) {
        self.backseat.updates.images.set(images);
    }

    /// What the board is to do with its images, until [`Self::updated`] answers.
    #[must_use]
    pub fn to_update(&self) -> Option<&Order> {
        self.backseat.updates.order.get()
    }

    /// The order of [`Self::to_update`] is carried out, or refused. After a commit the board sends what waits, and
    /// resets.
    pub fn updated(&mut self, outcome: Result<(), Refusal>, images: Images) {
        self.set_images(images);
        if self.backseat.updates.order.take().is_some() {
            send(&mut self.host_out, &outcome.map_or_else(FromBoard::Refused, |()| FromBoard::Done));
        }
    }
}
