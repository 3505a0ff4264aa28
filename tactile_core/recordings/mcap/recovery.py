"""Writes what is complete in an interrupted MCAP file to a new file with an index."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Any

from tactile_core.errors import InputError
from tactile_core.recordings.mcap.records import (
    ATTACHMENT,
    CHANNEL,
    MESSAGE,
    METADATA,
    SCHEMA,
    McapRecords,
)
from tactile_core.recordings.mcap.topics import PROFILE, mcap_library


def copy_messages(path: Path, fresh: Path) -> int:
    """Copy every complete message; return their number."""
    library = mcap_library("mcap.writer")
    records = McapRecords(path)
    try:
        with fresh.open("xb") as file:
            writer = library.Writer(file, compression=library.CompressionType.NONE)
            writer.start(PROFILE)
            messages = _copied(records, writer)
            writer.finish()
    except (ValueError, LookupError) as error:
        raise InputError(f"{path} is damaged in the middle; recover an earlier copy") from error
    finally:
        records.close()
    return messages


def _copied(records: McapRecords, writer: Any) -> int:
    """Write the records to a writer, and return the number of messages."""
    kinds = mcap_library("mcap.records")
    stream = mcap_library("mcap.data_stream")
    schemas, channels, messages = {0: 0}, dict[int, int](), 0
    for kind, place in records:
        if kind not in (SCHEMA, CHANNEL, MESSAGE, ATTACHMENT, METADATA):
            continue
        content = records.content(place)
        data = stream.ReadDataStream(BytesIO(content))
        if kind == SCHEMA:
            one = kinds.Schema.read(data)
            schemas[one.id] = writer.register_schema(one.name, one.encoding, one.data)
        elif kind == CHANNEL:
            one = kinds.Channel.read(data)
            channels[one.id] = writer.register_channel(
                one.topic, one.message_encoding, schemas[one.schema_id], one.metadata
            )
        elif kind == MESSAGE:
            one = kinds.Message.read(data, len(content))
            channel = channels[one.channel_id]
            writer.add_message(channel, one.log_time, one.data, one.publish_time, one.sequence)
            messages += 1
        elif kind == ATTACHMENT:
            one = kinds.Attachment.read(data)
            writer.add_attachment(one.create_time, one.log_time, one.name, one.media_type, one.data)
        else:
            one = kinds.Metadata.read(data)
            writer.add_metadata(one.name, one.metadata)
    return messages
