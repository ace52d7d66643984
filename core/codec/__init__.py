"""Trees and residuals as bytes, and back: the array side of `.sct` files."""

from demsmith.core.codec.coding import CodecOptions, Decoder, Encoded, encode

__all__ = ["CodecOptions", "Decoder", "Encoded", "encode"]
