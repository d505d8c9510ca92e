use super::*;

/// A record with this opcode.
fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
    [&[opcode], (body.len() as u64).to_le_bytes().as_slice(), body].concat()
}

/// A message on `channel` with `bytes` of data.
fn message(channel: u16, bytes: usize) -> Vec<u8> {
    let body = [channel.to_le_bytes().as_slice(), &[0; 20], &vec![0; bytes]].concat();
    record(op::MESSAGE, &body)
}

/// Bytes that follow their length of eight bytes.
fn long(bytes: &[u8]) -> Vec<u8> {
    [(bytes.len() as u64).to_le_bytes().as_slice(), bytes].concat()
}

/// Bytes that follow their length of four bytes.
fn short(bytes: &[u8]) -> Vec<u8> {
    [(bytes.len() as u32).to_le_bytes().as_slice(), bytes].concat()
}

/// One record of each kind that states inner lengths.
fn records() -> [Vec<u8>; 3] {
    let chunk = [vec![0; 28], short(b"zstd"), long(&[7; 40])].concat();
    let attachment = [vec![0; 16], short(b"notes.txt"), short(b"text/plain"), long(&[7; 40]), vec![0; 4]];
    let metadata = [short(b"ringwing"), short(&[short(b"key"), short(b"value")].concat())].concat();
    [record(op::CHUNK, &chunk), record(op::ATTACHMENT, &attachment.concat()), record(op::METADATA, &metadata)]
}

/// Whether a search in a file that ends with `window` resumes at its start; channel 3 is known.
fn is_record(window: &[u8], has_chunks: bool) -> bool {
    let channels = BTreeSet::from([3]);
    Landmarks { channels: &channels, has_chunks }.is_record(window, window.len() as u64)
}

#[test]
fn a_record_is_recognised_by_lengths_that_agree_and_if_it_is_whole() {
    for record in records() {
        let opcode = record[0];
        for has_chunks in [false, true] {
            assert!(is_record(&record, has_chunks), "{opcode}");
            let followed = [record.as_slice(), &[0; 9]].concat();
            assert!(is_record(&followed, has_chunks), "{opcode}");
            for cut in 0..record.len() {
                assert!(!is_record(&record[..cut], has_chunks), "{opcode} cut at {cut}");
            }
            // Another length may fit into the file as well, and is wrong.
            for wrong in [-1, 1] {
                let mut other = followed.clone();
                other[1] = other[1].wrapping_add_signed(wrong);
                assert!(!is_record(&other, has_chunks), "{opcode} with a length that is off by {wrong}");
            }
        }
    }
}

#[test]
fn messages_are_recognised_only_where_none_is_in_a_chunk() {
    let two = [message(3, 5), message(3, 9)].concat();
    assert!(is_record(&two, false));
    assert!(!is_record(&two, true));
}

#[test]
fn a_message_is_recognised_by_its_channel_its_length_and_what_follows() {
    assert!(is_record(&message(3, 5), false), "the file ends behind it");
    assert!(is_record(&[message(3, 0), message(3, 0)].concat(), false), "without any data");
    assert!(!is_record(&[message(4, 5), message(3, 5)].concat(), false), "the channel is unknown");
    assert!(!is_record(&[message(3, 5), message(4, 5)].concat(), false), "the next channel is unknown");
    assert!(!is_record(&[message(3, 5), vec![0; 40]].concat(), false), "noise follows");
    assert!(!is_record(&[message(3, 5), vec![0; 3]].concat(), false), "no head fits behind it");
    let too_short = [record(op::MESSAGE, &[3, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]), message(3, 5)].concat();
    assert!(!is_record(&too_short, false), "no message is so short");
    assert!(!is_record(&message(3, 5)[..30], false), "it is cut");
}

#[test]
fn among_messages_there_are_schemas_channels_chunks_attachments_metadata_and_the_end() {
    let followed_by = |opcode: u8, length: u64| {
        let head = [&[opcode], length.to_le_bytes().as_slice()].concat();
        is_record(&[message(3, 5), head].concat(), false)
    };
    for opcode in [op::SCHEMA, op::CHANNEL, op::CHUNK, op::ATTACHMENT, op::METADATA, op::DATA_END] {
        assert!(followed_by(opcode, 4) && followed_by(opcode, LONGEST_RECORD), "{opcode}");
        assert!(!followed_by(opcode, LONGEST_RECORD + 1), "{opcode}");
    }
    for opcode in [0, op::HEADER, op::FOOTER, op::MESSAGE_INDEX, op::STATISTICS, 0x80] {
        assert!(!followed_by(opcode, 4), "{opcode}");
    }
}

#[test]
fn records_have_the_opcodes_of_the_specification_or_are_private() {
    for opcode in [op::HEADER, op::MESSAGE, op::DATA_END, 0x80, 0xff] {
        assert!(is_opcode(opcode), "{opcode}");
    }
    for opcode in [0, op::DATA_END + 1, 0x7f] {
        assert!(!is_opcode(opcode), "{opcode}");
    }
}
