"""Bytes, sockets and topics: MAVLink codec and links, tlogs, Zenoh bus, wire messages, frames."""
