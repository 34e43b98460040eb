-- Precision and recall by kind of link. A link that was found is right if it is true, whether or
-- not the trace decides it; a true one that the trace decides and that was not found is missing.
-- Which of several messages with one stamp was taken is a guess, and so is which of several runs
-- filled a cache: marked as such in the database (candidate_count > 1), and not judged. Nor is what
-- is wrong inside a callback run that is marked (is_loss_affected) and has another one's end.
CREATE OR REPLACE TEMP TABLE verdict AS
WITH matched AS (
    SELECT
        f.number, f.kind, f.label, f.is_guess, f.from_id AS found_from_id, f.to_id AS found_to_id,
        l.from_id, l.to_id
    FROM found_link AS f
    LEFT JOIN truth_time AS a
        ON f.from_kind = a.kind AND f.from_host = a.host AND f.from_pid = a.pid
        AND f.from_tid = a.tid AND f.from_ns = a.ts_ns
    LEFT JOIN truth_time AS b
        ON f.to_kind = b.kind AND f.to_host = b.host AND f.to_pid = b.pid AND f.to_tid = b.tid
        AND f.to_ns = b.ts_ns
    LEFT JOIN (SELECT DISTINCT kind, from_id, to_id FROM truth_link) AS l
        ON f.kind = l.kind AND a.id = l.from_id AND b.id = l.to_id
    QUALIFY row_number() OVER (PARTITION BY f.number ORDER BY l.from_id NULLS LAST, l.to_id) = 1
),
misguessed_run AS (
    SELECT found_from_id
    FROM matched
    WHERE kind = 'callback_run' AND is_guess AND from_id IS NULL
)
SELECT
    * REPLACE (
        is_guess OR (
            from_id IS NULL
            AND kind IN ('direct', 'recorded_in')
            AND found_from_id IN (FROM misguessed_run)
        ) AS is_guess
    )
FROM matched;

CREATE OR REPLACE TEMP TABLE score AS
WITH hit AS (
    SELECT
        kind, from_id, to_id, count(*) AS rows, bool_and(is_guess) AS is_guess,
        count(DISTINCT (found_from_id, found_to_id)) AS pairs
    FROM verdict
    WHERE from_id IS NOT NULL
    GROUP BY kind, from_id, to_id
),
-- Two annotations of a node may both link one message to one publication; and what a loss tore in
-- two may have a link on either side.
truth AS (
    SELECT
        kind, from_id, to_id, count(*) AS happened,
        bool_or(
            (from_kind, from_id) IN (SELECT (kind, id) FROM truth_torn)
            OR (to_kind, to_id) IN (SELECT (kind, id) FROM truth_torn)
        ) AS is_torn
    FROM truth_link
    GROUP BY kind, from_id, to_id
),
repeated AS (
    SELECT
        h.kind,
        sum(
            h.rows - least(
                h.rows, greatest(t.happened, CASE WHEN t.is_torn THEN h.pairs ELSE 1 END)
            )
        )::BIGINT AS repeated
    FROM hit AS h
    JOIN truth AS t ON h.kind = t.kind AND h.from_id = t.from_id AND h.to_id = t.to_id
    GROUP BY h.kind
),
found AS (
    SELECT
        kind,
        count(*) AS found,
        count(from_id) AS right_count,
        count(*) FILTER (from_id IS NULL AND NOT is_guess) AS wrong,
        count(*) FILTER (
            from_id IS NULL AND NOT is_guess AND kind = 'transport'
            AND (found_from_id, found_to_id) IN (
                SELECT (publication_id, take_id)
                FROM analysed.store.link_transport
                WHERE method = 'nearest' AND is_loss_affected
            )
        ) AS loss_affected,
        count(*) FILTER (from_id IS NULL AND is_guess) AS misguessed
    FROM verdict
    GROUP BY kind
),
labelled AS (
    SELECT kind, string_agg(label || ' ' || right_count || '/' || found, ', ' ORDER BY label) AS labels
    FROM (
        SELECT kind, label, count(*) AS found, count(from_id) AS right_count
        FROM verdict
        GROUP BY kind, label
    )
    GROUP BY kind
),
expected AS (
    SELECT
        l.kind,
        count(*) AS happened,
        count(*) FILTER (l.is_decided) AS decided,
        count(*) FILTER (l.is_decided AND v.from_id IS NULL) AS missing,
        -- Runs are marked where anything of the host is missing meanwhile, answers where timers may
        -- be missing or few messages are left, and sets where another is nearly as narrow.
        count(*) FILTER (
            l.is_decided AND v.is_guess AND l.kind NOT IN ('callback_run', 'approximate_sync')
            AND (l.kind <> 'take_adjacent' OR NOT EXISTS (FROM truth_hole))
        ) AS doubted
    FROM truth_link AS l
    LEFT JOIN hit AS v
        ON l.kind = v.kind AND l.from_id = v.from_id AND l.to_id = v.to_id
    GROUP BY l.kind
)
SELECT
    coalesce(e.kind, f.kind) AS kind,
    coalesce(e.happened, 0) AS happened,
    coalesce(e.decided, 0) AS decided,
    coalesce(f.found, 0) AS found,
    coalesce(f.wrong, 0) AS wrong,
    coalesce(f.loss_affected, 0) AS loss_affected,
    coalesce(f.misguessed, 0) AS misguessed,
    coalesce(r.repeated, 0) AS repeated,
    coalesce(e.missing, 0) AS missing,
    coalesce(e.doubted, 0) AS doubted,
    coalesce(f.right_count / nullif(f.right_count + f.wrong, 0), 1) AS precision,
    coalesce(1 - e.missing / nullif(e.decided, 0), 1) AS recall,
    coalesce(labels, '') AS labels
FROM expected AS e
FULL JOIN found AS f ON e.kind = f.kind
LEFT JOIN repeated AS r ON coalesce(e.kind, f.kind) = r.kind
LEFT JOIN labelled AS s ON coalesce(e.kind, f.kind) = s.kind
-- Truth that says nothing of a kind does not judge it.
WHERE coalesce(e.kind, f.kind) IN (FROM judged)
ORDER BY 1;
