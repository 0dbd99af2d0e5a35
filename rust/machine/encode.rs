//! Listings as instructions of x86-64: AVX2, or AVX-512 for eight numbers at once.

use iced_x86::Code as Opcode;
use iced_x86::{Encoder, IcedError, Instruction, MemoryOperand, Register as Name};

use super::listing::{Array, Line, Listing, Operand, Operation, Place, Register};

/// The bytes of a listing, and where its functions begin in them.
pub(super) fn encode(listing: &Listing) -> Result<(Vec<u8>, Vec<usize>), IcedError> {
    let lanes = listing.lanes;
    let size = |place: Place| if place.0 == Array::Constants { 1 } else { lanes };
    let memory = |place: Place| {
        // The first arguments of a call.
        let base = [Name::RDI, Name::RSI, Name::RDX, Name::RCX, Name::R8][place.0 as usize];
        MemoryOperand::with_base_displ(base, 8 * (place.1 * size(place)) as i64)
    };
    let mut encoder = Encoder::try_new(64)?;
    let (mut at, mut starts) = (0, vec![0]);
    for &(width, line) in &listing.lines {
        let name = |register: Register| named(register, width);
        let of_width = |opcodes: [Opcode; 4]| opcodes[width.ilog2() as usize];
        let instruction = match line {
            Line::Load(to, Operand::Register(from)) => {
                Instruction::with2(of_width(COPY), name(to), name(from))?
            }
            Line::Load(to, Operand::Place(from)) => {
                let opcodes = if from.0 == Array::Constants { BROADCAST } else { LOAD };
                Instruction::with2(of_width(opcodes), name(to), memory(from))?
            }
            Line::Store(to, from) => Instruction::with2(of_width(STORE), memory(to), name(from))?,
            Line::Apply(operation, to, a, b) => {
                let opcode = of_width(opcodes(operation));
                match b {
                    // The square roots of packets take one operand.
                    Operand::Register(b) if operation == Operation::Root && width > 1 => {
                        Instruction::with2(opcode, name(to), name(b))?
                    }
                    Operand::Place(b) if operation == Operation::Root && width > 1 => {
                        Instruction::with2(opcode, name(to), memory(b))?
                    }
                    Operand::Register(b) => Instruction::with3(opcode, name(to), name(a), name(b))?,
                    Operand::Place(b) => Instruction::with3(opcode, name(to), name(a), memory(b))?,
                }
            }
            Line::LoadUpper(to, a, from) => {
                Instruction::with3(Opcode::VEX_Vmovhpd_xmm_xmm_m64, named(to, 2), named(a, 2), memory(from))?
            }
            Line::StoreUpper(to, from) => {
                Instruction::with2(Opcode::VEX_Vmovhpd_m64_xmm, memory(to), named(from, 2))?
            }
            Line::Join(to, a, b) => {
                let opcode = Opcode::VEX_Vinsertf128_ymm_ymm_xmmm128_imm8;
                Instruction::with4(opcode, named(to, 4), named(a, 4), named(b, 2), 1)?
            }
            Line::Part(to, from) => {
                let opcode = Opcode::VEX_Vextractf128_xmmm128_ymm_imm8;
                Instruction::with3(opcode, named(to, 2), named(from, 4), 1)?
            }
            Line::End => {
                // The upper halves of the registers are cleared, as callers expect.
                at += encoder.encode(&Instruction::with(Opcode::VEX_Vzeroupper), at)? as u64;
                Instruction::with(Opcode::Retnq)
            }
        };
        at += encoder.encode(&instruction, at)? as u64;
        if line == Line::End {
            starts.push(at as usize);
        }
    }
    Ok((encoder.take_buffer(), starts))
}

fn named(register: Register, width: usize) -> Name {
    let first = match width {
        8 => Name::ZMM0,
        4 => Name::YMM0,
        _ => Name::XMM0,
    };
    first + u32::from(register.0)
}

// For one, two, four and eight numbers at once.
const COPY: [Opcode; 4] = [
    Opcode::VEX_Vmovapd_xmm_xmmm128,
    Opcode::VEX_Vmovapd_xmm_xmmm128,
    Opcode::VEX_Vmovapd_ymm_ymmm256,
    Opcode::EVEX_Vmovapd_zmm_k1z_zmmm512,
];
const BROADCAST: [Opcode; 4] = [
    Opcode::VEX_Vmovsd_xmm_m64,
    Opcode::VEX_Vmovddup_xmm_xmmm64,
    Opcode::VEX_Vbroadcastsd_ymm_m64,
    Opcode::EVEX_Vbroadcastsd_zmm_k1z_xmmm64,
];
const LOAD: [Opcode; 4] = [
    Opcode::VEX_Vmovsd_xmm_m64,
    Opcode::VEX_Vmovupd_xmm_xmmm128,
    Opcode::VEX_Vmovupd_ymm_ymmm256,
    Opcode::EVEX_Vmovupd_zmm_k1z_zmmm512,
];
const STORE: [Opcode; 4] = [
    Opcode::VEX_Vmovsd_m64_xmm,
    Opcode::VEX_Vmovupd_xmmm128_xmm,
    Opcode::VEX_Vmovupd_ymmm256_ymm,
    Opcode::EVEX_Vmovupd_zmmm512_k1z_zmm,
];

fn opcodes(operation: Operation) -> [Opcode; 4] {
    use Opcode::*;
    match operation {
        Operation::Add => [
            VEX_Vaddsd_xmm_xmm_xmmm64,
            VEX_Vaddpd_xmm_xmm_xmmm128,
            VEX_Vaddpd_ymm_ymm_ymmm256,
            EVEX_Vaddpd_zmm_k1z_zmm_zmmm512b64_er,
        ],
        Operation::Sub => [
            VEX_Vsubsd_xmm_xmm_xmmm64,
            VEX_Vsubpd_xmm_xmm_xmmm128,
            VEX_Vsubpd_ymm_ymm_ymmm256,
            EVEX_Vsubpd_zmm_k1z_zmm_zmmm512b64_er,
        ],
        Operation::Mul => [
            VEX_Vmulsd_xmm_xmm_xmmm64,
            VEX_Vmulpd_xmm_xmm_xmmm128,
            VEX_Vmulpd_ymm_ymm_ymmm256,
            EVEX_Vmulpd_zmm_k1z_zmm_zmmm512b64_er,
        ],
        Operation::Div => [
            VEX_Vdivsd_xmm_xmm_xmmm64,
            VEX_Vdivpd_xmm_xmm_xmmm128,
            VEX_Vdivpd_ymm_ymm_ymmm256,
            EVEX_Vdivpd_zmm_k1z_zmm_zmmm512b64_er,
        ],
        Operation::Fused => [
            VEX_Vfmadd231sd_xmm_xmm_xmmm64,
            VEX_Vfmadd231pd_xmm_xmm_xmmm128,
            VEX_Vfmadd231pd_ymm_ymm_ymmm256,
            EVEX_Vfmadd231pd_zmm_k1z_zmm_zmmm512b64_er,
        ],
        Operation::Root => [
            VEX_Vsqrtsd_xmm_xmm_xmmm64,
            VEX_Vsqrtpd_xmm_xmmm128,
            VEX_Vsqrtpd_ymm_ymmm256,
            EVEX_Vsqrtpd_zmm_k1z_zmmm512b64_er,
        ],
        Operation::And => [
            VEX_Vandpd_xmm_xmm_xmmm128,
            VEX_Vandpd_xmm_xmm_xmmm128,
            VEX_Vandpd_ymm_ymm_ymmm256,
            EVEX_Vandpd_zmm_k1z_zmm_zmmm512b64,
        ],
        Operation::AndNot => [
            VEX_Vandnpd_xmm_xmm_xmmm128,
            VEX_Vandnpd_xmm_xmm_xmmm128,
            VEX_Vandnpd_ymm_ymm_ymmm256,
            EVEX_Vandnpd_zmm_k1z_zmm_zmmm512b64,
        ],
        Operation::Or => [
            VEX_Vorpd_xmm_xmm_xmmm128,
            VEX_Vorpd_xmm_xmm_xmmm128,
            VEX_Vorpd_ymm_ymm_ymmm256,
            EVEX_Vorpd_zmm_k1z_zmm_zmmm512b64,
        ],
        Operation::Xor => [
            VEX_Vxorpd_xmm_xmm_xmmm128,
            VEX_Vxorpd_xmm_xmm_xmmm128,
            VEX_Vxorpd_ymm_ymm_ymmm256,
            EVEX_Vxorpd_zmm_k1z_zmm_zmmm512b64,
        ],
    }
}
