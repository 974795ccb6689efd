# Makes a .cpp that holds a text file, so that the library needs no file at run time.
# cmake -DINPUT=f.csv -DOUTPUT=f.cpp -DNAMESPACE=volto::rig -DSYMBOL=kText -P EmbedText.cmake
file(READ "${INPUT}" text)
# A string literal has a length limit that compilers warn about; adjacent literals of one chunk each have not.
string(LENGTH "${text}" length)
set(literals "")
set(position 0)
while(position LESS length)
  string(SUBSTRING "${text}" ${position} 8000 chunk)
  string(APPEND literals "    R\"volto(${chunk})volto\"\n")
  math(EXPR position "${position} + 8000")
endwhile()
file(WRITE "${OUTPUT}" "namespace ${NAMESPACE} {\nextern const char* const ${SYMBOL};\nconst char* const ${SYMBOL} =\n${literals};\n}\n")
