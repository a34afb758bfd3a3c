//! The few Thumb instructions that move the stack pointer, call, or make the address of a function (Arm v7-M
//! Architecture Reference Manual, A7.7).

/// What an instruction does, as far as it matters here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Instruction {
    /// Moves the stack pointer down by so many bytes.
    Down(u32),
    /// Moves it by what a register holds.
    DownByRegister,
    /// Calls.
    Call(u64),
    /// Goes there.
    Branch(u64),
    /// Calls or goes where a register points.
    CallRegister,
    /// Lower half of a register.
    MoveLow(u8, u16),
    /// Upper half of a register.
    MoveHigh(u8, u16),
    /// Loads a word of the code.
    Load(u64),
    /// Anything else.
    Other,
}

/// The instruction at an address, and its length in bytes.
pub fn decode(first: u16, second: u16, at: u64) -> (Instruction, u64) {
    if first >> 11 >= 0b11101 { (decode_wide(first, second, at), 4) } else { (decode_narrow(first, at), 2) }
}

fn decode_narrow(code: u16, at: u64) -> Instruction {
    let low = u32::from(code & 0xFF);
    match code {
        // PUSH
        _ if code & 0xFE00 == 0xB400 => Instruction::Down(4 * (code & 0x1FF).count_ones()),
        // SUB SP, #
        _ if code & 0xFF80 == 0xB080 => Instruction::Down(4 * (low & 0x7F)),
        // ADD SP, register
        _ if code & 0xFF87 == 0x4485 => Instruction::DownByRegister,
        // BX, BLX; BX LR returns
        _ if code & 0xFF07 == 0x4700 && code & 0x78 != 0x70 => Instruction::CallRegister,
        // B with a condition, but not UDF and SVC
        _ if code & 0xF000 == 0xD000 && code & 0x0E00 != 0x0E00 => Instruction::Branch(branch(at, low << 1, 9)),
        // B
        _ if code & 0xF800 == 0xE000 => Instruction::Branch(branch(at, u32::from(code & 0x7FF) << 1, 12)),
        // LDR from behind the code
        _ if code & 0xF800 == 0x4800 => Instruction::Load(((at + 4) & !3) + u64::from(4 * low)),
        _ => Instruction::Other,
    }
}

fn decode_wide(first: u16, second: u16, at: u64) -> Instruction {
    let bits = |half: u16, from: u32, count: u32| u32::from(half) >> from & ((1 << count) - 1);
    // i:imm3:imm8
    let immediate = bits(first, 10, 1) << 11 | bits(second, 12, 3) << 8 | bits(second, 0, 8);
    let half = (bits(first, 0, 4) << 12 | immediate) as u16;
    let register = bits(second, 8, 4) as u8;
    let to_stack_pointer = second & 0x8F00 == 0x0D00;
    match (first, second) {
        // PUSH
        (0xE92D, _) => Instruction::Down(4 * second.count_ones()),
        // STR and STRD to [SP, #-]!
        (0xF84D, _) if second & 0x0F00 == 0x0D00 => Instruction::Down(bits(second, 0, 8)),
        (0xE96D, _) => Instruction::Down(4 * bits(second, 0, 8)),
        // VPUSH
        _ if first & 0xFFBF == 0xED2D && second & 0x0E00 == 0x0A00 => Instruction::Down(4 * bits(second, 0, 8)),
        // SUB SP, SP, # in its two forms, and by a register
        _ if first & 0xFBEF == 0xF1AD && to_stack_pointer => Instruction::Down(expand(immediate)),
        _ if first & 0xFBFF == 0xF2AD && to_stack_pointer => Instruction::Down(immediate),
        _ if first & 0xFFEF == 0xEBAD && second & 0x0F00 == 0x0D00 => Instruction::DownByRegister,
        // MOVW, MOVT
        _ if first & 0xFBF0 == 0xF240 && second & 0x8000 == 0 => Instruction::MoveLow(register, half),
        _ if first & 0xFBF0 == 0xF2C0 && second & 0x8000 == 0 => Instruction::MoveHigh(register, half),
        // LDR from beside the code
        _ if first & 0xFF7F == 0xF85F => {
            let (base, offset) = ((at + 4) & !3, u64::from(bits(second, 0, 12)));
            Instruction::Load(if first & 0x80 == 0 { base.wrapping_sub(offset) } else { base + offset })
        }
        // BL, B.W
        _ if first & 0xF800 == 0xF000 && second & 0x9000 == 0x9000 => {
            let sign = bits(first, 10, 1);
            let [i1, i2] = [13, 11].map(|bit| u32::from(bits(second, bit, 1) == sign));
            let offset = sign << 24 | i1 << 23 | i2 << 22 | bits(first, 0, 10) << 12 | bits(second, 0, 11) << 1;
            let target = branch(at, offset, 25);
            if second & 0x4000 == 0 { Instruction::Branch(target) } else { Instruction::Call(target) }
        }
        // B.W with a condition
        _ if first & 0xF800 == 0xF000 && second & 0xD000 == 0x8000 && bits(first, 7, 3) != 0b111 => {
            let offset = bits(first, 10, 1) << 20
                | bits(second, 11, 1) << 19
                | bits(second, 13, 1) << 18
                | bits(first, 0, 6) << 12
                | bits(second, 0, 11) << 1;
            Instruction::Branch(branch(at, offset, 21))
        }
        _ => Instruction::Other,
    }
}

/// Where a branch goes whose offset has so many bits.
fn branch(at: u64, offset: u32, bits: u32) -> u64 {
    let offset = (offset << (32 - bits)).cast_signed() >> (32 - bits);
    (at + 4).wrapping_add_signed(i64::from(offset))
}

/// ThumbExpandImm.
fn expand(immediate: u32) -> u32 {
    let byte = immediate & 0xFF;
    match immediate >> 8 {
        0 => byte,
        1 => byte << 16 | byte,
        2 => byte << 24 | byte << 8,
        3 => byte << 24 | byte << 16 | byte << 8 | byte,
        _ => (byte & 0x7F | 0x80).rotate_right(immediate >> 7),
    }
}

/// Encodings as an assembler gives them.
#[test]
fn val_instructions_are_understood() {
    let narrow = |code| decode(code, 0, 0x1000).0;
    let wide = |first, second| decode(first, second, 0x1000).0;
    assert_eq!(narrow(0xB5F0), Instruction::Down(20)); // push {r4-r7, lr}
    assert_eq!(narrow(0xB0BE), Instruction::Down(248)); // sub sp, #248
    assert_eq!(narrow(0x4770), Instruction::Other); // bx lr
    assert_eq!(narrow(0x47A0), Instruction::CallRegister); // blx r4
    assert_eq!(narrow(0x4718), Instruction::CallRegister); // bx r3
    assert_eq!(narrow(0xD1FE), Instruction::Branch(0x1000)); // bne .
    assert_eq!(narrow(0xE7FE), Instruction::Branch(0x1000)); // b .
    assert_eq!(narrow(0x4801), Instruction::Load(0x1008)); // ldr r0, [pc, #4]
    assert_eq!(wide(0xE92D, 0x0F00), Instruction::Down(16)); // push.w {r8-r11}
    assert_eq!(wide(0xF84D, 0xBD04), Instruction::Down(4)); // str r11, [sp, #-4]!
    assert_eq!(wide(0xED2D, 0x8B10), Instruction::Down(64)); // vpush {d8-d15}
    assert_eq!(wide(0xF5AD, 0x4D15), Instruction::Down(38144)); // sub.w sp, sp, #38144
    assert_eq!(wide(0xF6AD, 0x4D58), Instruction::Down(3160)); // subw sp, sp, #3160
    assert_eq!(wide(0xF247, 0x7038), Instruction::MoveLow(0, 0x7738)); // movw r0, #0x7738
    assert_eq!(wide(0xF2C0, 0x0104), Instruction::MoveHigh(1, 4)); // movt r1, #4
    assert_eq!(wide(0xF7FF, 0xFFFE), Instruction::Call(0x1000)); // bl .
    assert_eq!(wide(0xF7FF, 0xBFFE), Instruction::Branch(0x1000)); // b.w .
    assert_eq!(wide(0xF47F, 0xAFFE), Instruction::Branch(0x1000)); // bne.w .
}
