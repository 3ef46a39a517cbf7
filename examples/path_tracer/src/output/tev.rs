//! The viewer tev, over its socket: a picture that fills while it is made.
//!
//! Key decision: colours go in bands of rows, each a packet of its own, so that a viewer draws the first while the rest is under way and no
//! packet grows with the picture. What goes wrong is an error like that of a file.
//!
//! **Source:** Thomas Müller, tev; packets `CreateImage` and `UpdateImage` (third version) as in its `Ipc.cpp`. All numbers are
//! little-endian, texts end with a zero byte, and a packet begins with its own length.

use std::{
    io::Write as _,
    net::{TcpStream, ToSocketAddrs as _},
    path::Path,
    time::Duration,
};

use super::Picture;
use crate::error::Error;

/// Where tev listens unless it was told another port.
pub const PORT: u16 = 14158;

/// How long the other side may keep us waiting.
const PATIENCE: Duration = Duration::from_secs(5);
/// Values of a packet, about.
const VALUES: usize = 1 << 18;

const UPDATE_IMAGE: u8 = 6;
const CREATE_IMAGE: u8 = 4;
const CHANNELS: [&str; 3] = ["R", "G", "B"];

/// A connection to a running tev, with the picture that it shows.
#[derive(Debug)]
pub struct Viewer {
    stream: TcpStream,
    /// For messages.
    peer: String,
    name: String,
    /// What was created there.
    size: Option<(u32, u32)>,
}

impl Viewer {
    /// Connects to `HOST:PORT` or `HOST`; `name` is the picture's in the viewer's list.
    ///
    /// # Errors
    /// When there is no such host, or nobody listens.
    pub fn connect(address: &str, name: &str) -> Result<Viewer, Error> {
        let peer = format!("tev at {address}");
        let failed = |error: &dyn std::fmt::Display| Error::write(Path::new(&peer), error);
        let has_port = address.rsplit_once(':').is_some_and(|(_, port)| port.parse::<u16>().is_ok());
        let full = if has_port { address.to_owned() } else { format!("{address}:{PORT}") };
        let addresses = full.to_socket_addrs().map_err(|error| failed(&error))?;
        let mut refusal = std::io::Error::other("the name has no address");
        for address in addresses {
            match TcpStream::connect_timeout(&address, PATIENCE) {
                Ok(stream) => {
                    stream.set_write_timeout(Some(PATIENCE)).map_err(|error| failed(&error))?;
                    return Ok(Viewer { stream, peer, name: name.replace('\0', " "), size: None });
                }
                Err(error) => refusal = error,
            }
        }
        Err(failed(&refusal))
    }

    /// Shows the colours of a picture.
    ///
    /// # Errors
    /// When the picture does not fit its size, or the connection is gone.
    pub fn update(&mut self, picture: &Picture) -> Result<(), Error> {
        picture.check().map_err(|what| Error::write(Path::new(&self.peer), what))?;
        let size = (picture.width, picture.height);
        if self.size != Some(size) {
            self.send(&Packet::new(CREATE_IMAGE, &self.name).numbers(&[size.0, size.1]).channels())?;
            self.size = Some(size);
        }
        let width = picture.width as usize;
        let rows = (VALUES / (3 * width)).max(1);
        for (band, colors) in picture.color.chunks(rows * width).enumerate() {
            let (y, height) = ((band * rows) as u32, (colors.len() / width) as u32);
            let place = [0, y, picture.width, height];
            // The channels lie one after another: first value and distance of each, in values.
            let packet = Packet::new(UPDATE_IMAGE, &self.name).channels().numbers(&place).longs(&[0, 1, 2]).longs(&[3; 3]);
            self.send(&packet.floats(colors.as_flattened()))?;
        }
        Ok(())
    }

    fn send(&mut self, packet: &Packet) -> Result<(), Error> {
        let bytes = packet.bytes();
        self.stream.write_all(&bytes).map_err(|error| Error::write(Path::new(&self.peer), error))
    }
}

/// Bytes behind the length.
struct Packet(Vec<u8>);

impl Packet {
    /// Of a kind, about a picture, without taking the focus.
    fn new(kind: u8, name: &str) -> Packet {
        Packet([&[kind, 0], name.as_bytes(), &[0]].concat())
    }

    fn numbers(mut self, numbers: &[u32]) -> Packet {
        self.0.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
        self
    }

    fn longs(mut self, numbers: &[u64]) -> Packet {
        self.0.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
        self
    }

    fn floats(mut self, numbers: &[f32]) -> Packet {
        self.0.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
        self
    }

    /// Their number and their names.
    fn channels(self) -> Packet {
        let mut packet = self.numbers(&[CHANNELS.len() as u32]);
        CHANNELS.iter().for_each(|name| packet.0.extend([name.as_bytes(), &[0]].concat()));
        packet
    }

    fn bytes(&self) -> Vec<u8> {
        let length = self.0.len() as u32 + 4;
        [&length.to_le_bytes(), &self.0[..]].concat()
    }
}

#[cfg(test)]
mod tests {
    use std::{io::Read as _, net::TcpListener};

    use super::*;

    /// Reads fields of a packet as the other side does.
    struct Fields<'a>(&'a [u8]);

    impl Fields<'_> {
        fn take<const N: usize>(&mut self) -> [u8; N] {
            let (field, rest) = self.0.split_first_chunk().expect("another field");
            self.0 = rest;
            *field
        }

        fn text(&mut self) -> String {
            let end = self.0.iter().position(|byte| *byte == 0).expect("an end");
            let text = String::from_utf8(self.0[..end].to_vec()).expect("UTF-8");
            self.0 = &self.0[end + 1..];
            text
        }

        fn number(&mut self) -> u32 {
            u32::from_le_bytes(self.take())
        }
    }

    // Kills: a length without itself, fields in another order, rows of a band at the wrong place, a picture created twice.
    #[test]
    fn a_viewer_gets_the_whole_picture() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap().to_string();
        let listening = std::thread::spawn(move || {
            let mut bytes = Vec::new();
            listener.accept().unwrap().0.read_to_end(&mut bytes).unwrap();
            bytes
        });
        // Wide enough for two bands.
        let (width, height) = (40_000, 3);
        let color: Vec<[f32; 3]> = (0..width * height).map(|i| [i as f32, -(i as f32), 0.5]).collect();
        let picture = Picture::of_color(width, height, color.clone());
        let mut viewer = Viewer::connect(&address, "box").unwrap();
        viewer.update(&picture).unwrap();
        viewer.update(&picture).unwrap();
        drop(viewer);

        let bytes = listening.join().unwrap();
        let mut rest = &bytes[..];
        let (mut received, mut created) = (vec![[0.0; 3]; color.len()], 0);
        while !rest.is_empty() {
            let length = u32::from_le_bytes(*rest.first_chunk().unwrap()) as usize;
            let (packet, behind) = rest.split_at(length);
            rest = behind;
            let mut fields = Fields(&packet[4..]);
            let [kind, takes_focus] = fields.take();
            assert_eq!((fields.text().as_str(), takes_focus), ("box", 0));
            match kind {
                4 => {
                    created += 1;
                    assert_eq!([fields.number(), fields.number(), fields.number()], [width, height, 3]);
                    assert_eq!([fields.text(), fields.text(), fields.text()], ["R", "G", "B"]);
                }
                6 => {
                    assert_eq!(fields.number(), 3);
                    assert_eq!([fields.text(), fields.text(), fields.text()], ["R", "G", "B"]);
                    let [x, y, w, h] = std::array::from_fn(|_| fields.number());
                    assert_eq!((x, w), (0, width));
                    let offsets: [u64; 3] = std::array::from_fn(|_| u64::from_le_bytes(fields.take()));
                    let strides: [u64; 3] = std::array::from_fn(|_| u64::from_le_bytes(fields.take()));
                    let values: Vec<f32> = fields.0.as_chunks::<4>().0.iter().map(|word| f32::from_le_bytes(*word)).collect();
                    fields.0 = &[];
                    for pixel in 0..w * h {
                        let place = (y * width + pixel) as usize;
                        received[place] = std::array::from_fn(|c| values[(offsets[c] + strides[c] * u64::from(pixel)) as usize]);
                    }
                }
                other => panic!("packet of kind {other}"),
            }
            assert!(fields.0.is_empty());
        }
        assert_eq!((created, received), (1, color));
    }

    // Kills: waiting for nobody, a message that does not say who was not there.
    #[test]
    fn nobody_there_is_said() {
        let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let text = Viewer::connect(&format!("127.0.0.1:{port}"), "box").unwrap_err().to_string();
        assert!(text.contains(&format!("tev at 127.0.0.1:{port}")), "{text}");
    }
}
