//! Requests to renew the board's firmware: the app decides whether, the board does it
//! ([`store::ImageFlash`](crate::store::ImageFlash)).

use crate::held::Held;
use crate::store::ImageFlash;
use backseat_wire::hostlink::{Image, Images, Refusal, ToBoard, UPDATE_CHUNK};
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

    /// The board has two banks, and this is what is in them.
    pub fn set_images(&mut self, images: Images) {
        self.images.set(images);
    }

    pub fn order(&self) -> Option<&Order> {
        self.order.get()
    }

    /// The board is to do what a request asks for.
    ///
    /// # Errors
    /// As [`Order::of`].
    pub fn request(&mut self, request: &ToBoard<'_>) -> Result<(), Refusal> {
        self.order.set(Order::of(request)?);
        Ok(())
    }

    /// The board has done it, or could not; whether there was an order.
    pub fn done(&mut self) -> bool {
        self.order.take().is_some()
    }

    pub fn is_busy(&self) -> bool {
        self.order.get().is_some()
    }

    /// The image that runs may yet be taken back.
    pub fn is_on_trial(&self) -> bool {
        self.images.get().is_some_and(|images| images.trial.is_some())
    }
}
