-- title: Network packets that clocks are not brought together by
-- description: Packets of the network were recorded whose two ends are not known.
-- cause: They look like others, were repeated, or went to or came from hosts that are not traced.
-- cure: None needed; docs/clocks.md says which packets are used.
-- grain: one row, if there are any
-- severity: info
-- when: staging.network_packet
WITH packet_use AS (
    SELECT
        count(*) AS number,
        count(CASE WHEN p.is_sent THEN 1 END) AS sent,
        count(CASE WHEN p.key IS NULL THEN 1 END) AS unknown,
        count(CASE WHEN p.key IS NOT NULL AND s.event_id IS NULL THEN 1 END) AS repeated,
        count(s.event_id) AS single,
        string_agg(DISTINCT h.hostname, ' and ' ORDER BY h.hostname) AS hosts
    FROM staging.network_packet AS p
    JOIN staging.trace AS t ON p.trace_id = t.trace_id
    JOIN staging.host AS h ON t.host_id = h.host_id
    LEFT JOIN staging.single_packet AS s ON p.event_id = s.event_id
    HAVING (SELECT count(*) FROM staging.clock) > 1
)
SELECT
    u.number - l.ends AS count,
    printf(
        'of %d network packets sent and %d received on %s, %d were seen on both ends; not used: '
        || '%d that look like others, %d that were repeated within 2 s or sent by several hosts, '
        || '%d whose other end was not seen or is not certain',
        u.sent, u.number - u.sent, u.hosts, l.links, u.unknown, u.repeated, u.single - l.ends
    ) AS detail
FROM packet_use AS u
CROSS JOIN (
    SELECT
        count(*) AS links,
        count(DISTINCT sent_event_id) + count(DISTINCT received_event_id) AS ends
    FROM staging.link_packet
) AS l
WHERE u.number > l.ends
