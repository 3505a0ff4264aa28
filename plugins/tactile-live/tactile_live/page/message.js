// Reads the messages of the server: a header of JSON, then arrays and pictures.

const TYPES = {
  uint8: Uint8Array, int16: Int16Array, uint16: Uint16Array,
  float32: Float32Array, float64: Float64Array,
};

export function readMessage(buffer) {
  const size = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, size)));
  const begin = 4 + size;
  return {
    header,
    bytes: (place) => new Uint8Array(buffer, begin + place.at, place.bytes),
    array: (place) => {
      const Kind = TYPES[place.type];
      return new Kind(buffer, begin + place.at, place.bytes / Kind.BYTES_PER_ELEMENT);
    },
  };
}
