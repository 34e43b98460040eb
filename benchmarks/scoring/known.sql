-- Nodes of real systems wrote down their own messages only: what ROS or others sent and took is not
-- judged, nor a message that only its receiver wrote down.
DELETE FROM found_link AS f
WHERE NOT EXISTS (
    FROM truth_time AS t
    WHERE f.to_kind = t.kind AND f.to_host = t.host AND f.to_pid = t.pid AND f.to_tid = t.tid
        AND f.to_ns = t.ts_ns
        AND (
            f.to_kind = 'publication'
            OR EXISTS (
                FROM truth_link AS l
                -- Whether a goal was accepted: both answers are judged.
                WHERE (f.kind = l.kind OR f.kind LIKE 'goal_%') AND t.id = l.to_id
            )
        )
);
