-- description: The moment at which a part of a flow begins. Moments of one list are sorted by time.
CREATE OR REPLACE MACRO derive.moment(
    part, at_ns, publication_id := NULL, callback_instance_id := NULL, callback_id := NULL,
    busy_min_ns := NULL, busy_max_ns := NULL
) AS {
    'at_ns': at_ns::BIGINT, 'part': part, 'publication_id': publication_id::BIGINT,
    'callback_instance_id': callback_instance_id::BIGINT, 'callback_id': callback_id::BIGINT,
    'busy_min_ns': busy_min_ns::BIGINT, 'busy_max_ns': busy_max_ns::BIGINT
}
