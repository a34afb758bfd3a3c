//! Requests to renew the firmware: who may, when, and what is answered.

use crate::board::{Board, Direct};
use crate::flight::start;
use crate::world::World;
use backseat_app::Order;
use backseat_wire::hostlink::{Image, Images, Refusal, ToBoard, UPDATE_CHUNK};

const IMAGE: Image = Image { length: 4096, crc: 7, build: 9 };
const NONE: Images = Images { trial: None, other: None };

fn answer(board: &mut Direct, message: &ToBoard<'_>) -> Option<Result<(), Refusal>> {
    board.heard().answers.clear();
    board.request(message);
    board.heard().answers.pop()
}

#[test]
fn an_order_is_answered_when_the_board_has_carried_it_out() {
    let mut board = Direct::new(None);
    assert_eq!(answer(&mut board, &ToBoard::UpdateGet), Some(Err(Refusal::NoStore)), "a board without two banks");
    assert_eq!(answer(&mut board, &ToBoard::UpdateBegin(IMAGE)), Some(Err(Refusal::NoStore)));
    board.app_mut().set_images(NONE);
    board.request(&ToBoard::UpdateGet);
    assert_eq!(board.heard().images, Some(NONE));
    assert_eq!(answer(&mut board, &ToBoard::UpdateBegin(IMAGE)), None);
    assert_eq!(board.app().to_update(), Some(&Order::Begin(IMAGE)));
    assert!(!board.app().lends_clock(), "flash is written");
    assert_eq!(answer(&mut board, &ToBoard::UpdateCommit), Some(Err(Refusal::NotReady)), "one after the other");
    assert_eq!(answer(&mut board, &ToBoard::FinWiggle), Some(Err(Refusal::NotReady)));
    for outcome in [Ok(()), Err(Refusal::StoreFailed)] {
        board.app_mut().updated(outcome, NONE);
        board.request(&ToBoard::UpdateGet); // what waits is heard with it
        assert_eq!((board.heard().answers.pop(), board.app().to_update()), (Some(outcome), None));
        let bytes = [1; UPDATE_CHUNK];
        assert_eq!(answer(&mut board, &ToBoard::UpdateWrite { offset: 0, bytes: &bytes }), None);
    }
    board.app_mut().updated(Ok(()), NONE);
    board.request(&ToBoard::UpdateGet);
    let bytes = [1; UPDATE_CHUNK + 1];
    let too_many = ToBoard::UpdateWrite { offset: 0, bytes: &bytes };
    assert_eq!(answer(&mut board, &too_many), Some(Err(Refusal::OutOfRange)));
}

#[test]
fn nothing_is_renewed_under_way_and_nothing_flown_on_trial() {
    let mut world = World::new();
    let mut board = Direct::new(None);
    board.app_mut().set_images(Images { trial: Some(1), other: None });
    assert_eq!(answer(&mut board, &ToBoard::MissionStart), Some(Err(Refusal::OnTrial)));
    board.app_mut().set_images(NONE);
    start(&mut board);
    world.run(&mut board, 10);
    assert!(board.app().is_under_way());
    for request in [
        ToBoard::UpdateBegin(IMAGE),
        ToBoard::UpdateWrite { offset: 0, bytes: &[0; 32] },
        ToBoard::UpdateCommit,
        ToBoard::UpdateConfirm,
    ] {
        assert!(request.changes_a_flight());
        assert_eq!(answer(&mut board, &request), Some(Err(Refusal::UnderWay)), "{request:?}");
    }
    assert_eq!(board.app().to_update(), None);
}
