-- description: Packets that were seen being sent on one clock and received on another. To find
--     roughly how far two clocks are apart, the times of ends with equal keys are compared, of the
--     rarest keys first. The difference that most of them agree on to within a second counts,
--     unless another one does nearly as well. Two ends of a key belong together if their difference
--     is within a second of that.
-- grain: one row per packet and clock that received it
-- when: staging.single_packet
WITH counted AS (
    SELECT
        clock_id, is_sent, key,
        count(*) AS number
    FROM staging.single_packet
    GROUP BY clock_id, is_sent, key
),
shared AS (
    SELECT
        s.clock_id AS from_clock_id,
        r.clock_id AS to_clock_id,
        s.key
    FROM counted AS s
    JOIN counted AS r ON s.key = r.key
    WHERE s.is_sent AND NOT r.is_sent AND s.clock_id <> r.clock_id
    QUALIFY sum(s.number * r.number) OVER (
        PARTITION BY s.clock_id, r.clock_id ORDER BY s.number * r.number, s.key
        ROWS UNBOUNDED PRECEDING
    ) <= 1_000_000
),
difference AS (
    SELECT
        k.from_clock_id, k.to_clock_id,
        r.ts_ns - s.ts_ns AS way_ns
    FROM shared AS k
    JOIN staging.single_packet AS s ON k.key = s.key AND k.from_clock_id = s.clock_id
    JOIN staging.single_packet AS r ON k.key = r.key AND k.to_clock_id = r.clock_id
    WHERE s.is_sent AND NOT r.is_sent
),
-- Each difference votes for both of the stretches of two seconds that it lies in.
stretch AS (
    SELECT
        from_clock_id, to_clock_id, second,
        count(*) AS votes,
        quantile_disc(way_ns, 0.5) AS shift_ns
    FROM (
        SELECT
            from_clock_id, to_clock_id, way_ns,
            unnest([floor(way_ns / 1e9)::BIGINT, floor(way_ns / 1e9)::BIGINT + 1]) AS second
        FROM difference
    )
    GROUP BY from_clock_id, to_clock_id, second
),
elected AS (
    SELECT from_clock_id, to_clock_id, second, votes, shift_ns
    FROM stretch
    QUALIFY row_number() OVER (
        PARTITION BY from_clock_id, to_clock_id ORDER BY votes DESC, second
    ) = 1
),
apart AS (
    SELECT e.from_clock_id, e.to_clock_id, e.shift_ns
    FROM elected AS e
    LEFT JOIN stretch AS o
        ON e.from_clock_id = o.from_clock_id
        AND e.to_clock_id = o.to_clock_id
        AND abs(e.second - o.second) > 1
    GROUP BY e.from_clock_id, e.to_clock_id, e.shift_ns, e.votes
    HAVING coalesce(max(o.votes), 0) * 1.2 <= e.votes
),
-- When each packet should be received. What is within a second of that lies in the same second or
-- in a neighbouring one.
due AS (
    SELECT
        s.event_id, s.trace_id, s.ts_ns, s.key, a.to_clock_id,
        s.ts_ns + a.shift_ns AS due_ns,
        unnest(range(due_ns // 1_000_000_000 - 1, due_ns // 1_000_000_000 + 2)) AS second
    FROM staging.single_packet AS s
    JOIN apart AS a ON s.clock_id = a.from_clock_id
    WHERE s.is_sent
),
matched AS (
    SELECT
        s.event_id AS sent_event_id,
        r.event_id AS received_event_id,
        s.trace_id AS sent_trace_id,
        r.trace_id AS received_trace_id,
        s.ts_ns AS sent_ns,
        r.ts_ns AS received_ns
    FROM due AS s
    JOIN staging.single_packet AS r
        ON s.key = r.key AND s.to_clock_id = r.clock_id AND s.second = r.ts_ns // 1_000_000_000
    WHERE NOT r.is_sent AND abs(r.ts_ns - s.due_ns) < 1_000_000_000
)
SELECT
    m.sent_trace_id, m.received_trace_id, m.sent_event_id, m.received_event_id, m.sent_ns,
    m.received_ns,
    CASE WHEN p.sequence_number IS NULL THEN 'udp' ELSE 'tcp' END AS protocol,
    CASE
        WHEN len(p.source_address) = 4 THEN array_to_string(p.source_address, '.')
        ELSE array_to_string(list_transform(p.source_address, lambda x: format('{:x}', x)), ':')
    END AS source_address,
    p.source_port,
    CASE
        WHEN len(p.destination_address) = 4 THEN array_to_string(p.destination_address, '.')
        ELSE array_to_string(
            list_transform(p.destination_address, lambda x: format('{:x}', x)), ':'
        )
    END AS destination_address,
    p.destination_port, p.identification, p.sequence_number
FROM matched AS m
JOIN raw.net_dev_queue AS p ON m.sent_event_id = p.event_id
ORDER BY m.sent_trace_id, m.sent_ns, m.received_trace_id, m.received_ns
