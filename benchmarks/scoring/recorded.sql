-- What is true of a recorded system, from its truth.jsonl.gz (the view recorded). Kinds of links:
-- `annot` is what annotations and trace imply, `seen` what the trace shows.

CREATE OR REPLACE TEMP TABLE hostname AS
SELECT entry.key AS host, entry.value.hostname AS hostname
FROM (SELECT unnest(map_entries(hosts)) AS entry FROM recorded WHERE t = 'meta');

CREATE OR REPLACE TEMP TABLE truth_time AS
WITH instance AS (
    SELECT
        CASE
            WHEN t = 'cb' THEN 'callback_instance'
            WHEN kind IN ('topic', 'intra') THEN CASE t WHEN 'pub' THEN 'publication' ELSE t END
            WHEN t = 'pub' THEN kind || '_sent'
            ELSE kind || '_taken'
        END AS kind,
        id, host, vpid, vtid,
        CASE WHEN t = 'cb' THEN ["start", "end"] ELSE map_values(ev) END AS times
    FROM recorded
    WHERE t IN ('pub', 'take', 'cb')
    UNION ALL
    SELECT 'take', k.id, k.host, k.vpid, k.vtid, [c."start"]
    FROM recorded AS k
    JOIN recorded AS c ON k.t = 'take' AND c.t = 'cb' AND k.cb = c.id
    WHERE k.kind IN ('topic', 'intra')
)
SELECT DISTINCT i.kind, i.id, n.hostname AS host, i.vpid AS pid, i.vtid AS tid, moment AS ts_ns
FROM (SELECT kind, id, host, vpid, vtid, unnest(times) AS moment FROM instance) AS i
JOIN hostname AS n ON i.host = n.host
WHERE moment IS NOT NULL;

-- Nothing says what of these recordings is missing or was torn.
CREATE OR REPLACE TEMP TABLE truth_torn (kind VARCHAR, id VARCHAR);
CREATE OR REPLACE TEMP TABLE truth_hole (host VARCHAR);

CREATE OR REPLACE TEMP TABLE truth_link AS
WITH pub AS (FROM recorded WHERE t = 'pub'),
take AS (FROM recorded WHERE t = 'take'),
callback AS (FROM recorded WHERE t = 'cb'),
-- As in simulated.sql: other runs of the callback could have filled the cache.
doubtful AS (
    SELECT DISTINCT l."in", l."out"
    FROM recorded AS l
    JOIN take AS k ON l."in" = k.id
    JOIN callback AS i ON k.cb = i.id
    JOIN pub AS b ON l."out" = b.id
    JOIN callback AS r ON b.cb = r.id
    LEFT JOIN callback AS o
        ON i.host = o.host AND i.vpid = o.vpid AND i.name = o.name AND i.id <> o.id
        AND CASE l.type
            WHEN 'partial_sync' THEN
                coalesce(o."end" > i."start", true)
                AND o."start" < list_min(map_values(b.ev))
            ELSE o."end" > i."end" AND o."end" <= r."start"
        END
    WHERE l.t = 'link' AND l.type IN ('periodic_async', 'partial_sync')
        AND (o.id IS NOT NULL OR coalesce(i."end" > r."start", true))
),
-- In Humble, only the time of a stamp tells of which publication a message is. A write goes on until
-- the next event of the thread, and the middleware stamps the message meanwhile.
written AS (
    SELECT
        b.id, b.topic, b.host, b.written_ns, e.ts_ns AS next_ns,
        -- The soonest stamp within 0.1 s comes at once: its difference is that of the clocks. The
        -- greater one of both sides is that of this side of a step.
        b.src - greatest(
            min(b.src - b.written_ns) OVER (
                on_host RANGE BETWEEN 100_000_000 PRECEDING AND CURRENT ROW
            ),
            min(b.src - b.written_ns) OVER (
                on_host RANGE BETWEEN CURRENT ROW AND 100_000_000 FOLLOWING
            )
        ) AS stamped_ns
    FROM (SELECT *, ev['rmw_publish'] AS written_ns FROM pub) AS b
    ASOF LEFT JOIN (
        SELECT host, vpid, vtid, unnest(map_values(ev)) AS ts_ns FROM recorded
        UNION ALL
        SELECT host, vpid, vtid, unnest(["start", "end"]) FROM callback
    ) AS e
        ON b.host = e.host AND b.vpid = e.vpid AND b.vtid = e.vtid AND b.written_ns < e.ts_ns
    WHERE b.written_ns IS NOT NULL
        AND 'humble' IN (SELECT flavour FROM recorded WHERE t = 'meta')
    WINDOW on_host AS (PARTITION BY b.host ORDER BY b.written_ns)
),
-- A message may be of any write of its topic that goes on at its stamp. Two messages that were
-- stamped in one write, one of them by a publisher that is not traced, may both be of it.
rivalled AS (
    SELECT a.id
    FROM written AS a
    JOIN written AS b
        ON a.topic = b.topic AND a.host = b.host AND a.id <> b.id
        AND a.stamped_ns >= b.written_ns AND coalesce(a.stamped_ns < b.next_ns, true)
    UNION
    SELECT a.id
    FROM written AS a
    JOIN pub AS o ON a.topic = o.topic AND a.host = o.host AND o.ev['rmw_publish'] IS NULL
    SEMI JOIN take AS k ON o.id = k.msg
    JOIN pub AS b ON a.id = b.id
    WHERE o.src - (b.src - a.stamped_ns) BETWEEN a.written_ns AND a.next_ns
),
link AS (
    SELECT
        l.type, k.cb, l."out", l.seen = 1 AND d."in" IS NULL AS is_seen
    FROM recorded AS l
    JOIN take AS k ON l."in" = k.id
    LEFT JOIN doubtful AS d ON l."in" = d."in" AND l."out" = d."out"
    WHERE l.t = 'link' AND l.annot = 1
)
SELECT
    'transport' AS kind, 'publication' AS from_kind, p.id AS from_id, 'take' AS to_kind,
    k.id AS to_id,
    p.seen = 1 AND k.seen = 1
    AND (k.kind = 'intra' OR p.id NOT IN (FROM rivalled)) AS is_decided
FROM take AS k
JOIN pub AS p ON k.msg = p.id
WHERE k.kind IN ('topic', 'intra')
UNION ALL
SELECT
    k.kind, k.kind || '_sent', p.id, k.kind || '_taken', k.id, p.seen = 1 AND k.seen = 1
FROM take AS k
JOIN pub AS p ON k.msg = p.id
WHERE k.kind IN ('request', 'response')
UNION ALL
SELECT
    CASE kind WHEN 'request' THEN 'link_request' ELSE 'direct' END, 'callback_instance', cb,
    CASE kind WHEN 'request' THEN 'request_sent' ELSE 'publication' END, id, seen = 1
FROM pub
-- What clients do with a response is in no callback that is traced.
WHERE kind <> 'response'
    AND cb IN (SELECT id FROM callback WHERE kind <> 'client' AND "start" IS NOT NULL)
UNION ALL
-- rclpy has no events of callbacks: there, a message causes what its thread publishes next. What a
-- timer publishes has no cause.
SELECT 'take_adjacent', 'take', k.id, 'publication', b.id, k.seen = 1 AND b.seen = 1
FROM take AS k
JOIN callback AS c ON k.cb = c.id
JOIN pub AS b ON b.cb = c.id
WHERE k.kind = 'topic' AND b.kind = 'topic' AND c."start" IS NULL
UNION ALL
SELECT
    CASE type WHEN 'service' THEN 'link_response' ELSE type END, 'callback_instance', cb,
    CASE type WHEN 'service' THEN 'response_sent' ELSE 'publication' END, "out", is_seen
FROM link
WHERE type NOT LIKE 'direct%' AND cb IS NOT NULL
UNION ALL
SELECT 'link_call', 'response_taken', k.id, 'publication', l."out", l.seen = 1
FROM recorded AS l
JOIN take AS k ON l."in" = k.id
WHERE l.t = 'link' AND k.kind = 'response'
UNION ALL
-- What a callback still has of an earlier one does not show.
SELECT 'polled', 'take', l."in", 'publication', l."out", l.seen = 1 AND k.host = c.host
    AND k.vpid = c.vpid AND k.vtid = c.vtid AND list_min(map_values(k.ev)) > c."start"
FROM recorded AS l
JOIN take AS k ON l."in" = k.id
JOIN pub AS b ON l."out" = b.id
JOIN callback AS c ON b.cb = c.id
WHERE l.t = 'link' AND l.type = 'polled';
