"""Decoder of CTF 1.8 and CTF 2, on numpy and pyarrow alone.

1. Metadata in TSDL or JSON becomes declarations made of field types (`tsdl`, `json_metadata`,
   `declarations`, `field_types`).
2. Stream files become a table of packets in order of time (`packets`, `packet_order`).
3. Packets are loaded in batches, and their events are found and put in order of time
   (`packet_memory`, `events`, `event_order`). Finding is the only step that goes from event to
   event.
4. The fields of all events of one class become columns at once (`field_columns`,
   `record_batch`). Whatever has no layout for that is read field by field
   (`field_reader`): slower, but any type will do.
"""
