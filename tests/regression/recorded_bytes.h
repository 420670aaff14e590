#pragma once
#include <map>
#include <string>

// SHA-256 of the files of bytes_test.cpp, for each instruction set. Scene and fields were recorded at commit
// 07c747b; owners and all that is made with them, at the commit where Muon began to train the extractor's
// matrices; baked fields and what is read from them, at the commit that bakes with emphasis and with
// small steps on fine levels, but "fast logits" on AVX2 at the commit that makes the last small motion of an
// alignment, and owners and baked fields of presets paper and code at the commit that takes the product of a
// message once an image. AVX-512 is not recorded.
inline const std::map<std::string, std::string> kBytesV2{
    {"code baked field", "45939742eceb32348e211e100dffcb0e89bb4306a78d3522bfd7281dd2b9a5b7"},
    {"code logits", "9613e54e8692e34788c1420773b95ac1f73cad031192077e2866490bda867c3e"},
    {"code owner", "9d5df2179b567a8d0622a68f889e611349b8e0c1b3ef224a805e7e4b21b06587"},
    {"code renders", "d0bca072caacf18a15df2011528728fca35746a11ee89388767de5176b1fdce3"},
    {"fast baked field", "15c7025b7fb69f3db9148715acaf30a437513e0260e28d2ddecb10697c89fcfc"},
    {"fast logits", "f8d162a0fcbdf82389111123b056025e563404d61a1a9d35711d5c5fa7f68979"},
    {"fast owner", "0e2b276bee54492a21f524a218b5386f2feb071f451b22bb4e409198ab7c548c"},
    {"fast renders", "ce84596ccd3d348d119c53c57cbe7c064b4ce9d738dd09d55d5efa7d5dd3b8b8"},
    {"hash field", "7169f1e7a7340da7cd7253b251b0cd4a79ddbae0180376de07068fb54e49625e"},
    {"mlp field", "7b33409f716c7056416cecc68cb45c617c9aca7da414de414f01d9eeff7cdb82"},
    {"paper baked field", "b4dea3d03359535da48642d20f2312ae6beb7fc4ff1081164267ea6703b4e4ce"},
    {"paper logits", "56e424adb296950876ab8f3e014143aa29f7599de504457f2c42197769474182"},
    {"paper owner", "338aba49d597c980e962403b49ed01c0b0adba1d1ce8b43ec1efb1f6e706ae7e"},
    {"paper renders", "55266355752c4130cddab01038d2832c572a2b8fbf917944c6595f1ec4451938"},
    {"scene", "15bf0def4f0aafd36af902743d49e9f0b84f3c33f7f1a5522020bce02dc28ac2"}};
inline const std::map<std::string, std::string> kBytesV3{
    {"code baked field", "81ba31a821e86c15ca4d7a69de1fa8dff47c5c4318b647ae74d3f32643a10477"},
    {"code logits", "ffcee264fa4775230837e60e2f1f6924d57de0dc5095160442c3c5c097127659"},
    {"code owner", "793be7646196965f04c7b0293cbf2ea6fad27656cf3c9fdfbd875e4e4af76a5c"},
    {"code renders", "a5f6f7610d3dde3d4744590c2ef9f553cc8866fdfa796d814676b5d6f7948a43"},
    {"fast baked field", "17af66e1d94b2ccfda000cc01e7e5494f8f021d7bc49bf7e8cbbedc7d659aaac"},
    {"fast logits", "f6aba7ec931e26b80aca73945a129333d2587d2a08174004bc9992a33d94c385"},
    {"fast owner", "1cb3eb634830b3ffab0d7aab39e5b7bae380052cf3489c93a842a670f5b8cdcb"},
    {"fast renders", "98e6bbc8b57e790ffb2b0180c23758711182e177f2b22bec0f90a97680446b64"},
    {"hash field", "ddb8c16b2d62994a59ed8aa4ae932d923e75564baf99a3cbcda6591352018d07"},
    {"mlp field", "75b9aa11ccbf62dada9278d143ad378beee4521b95c4db7fe9702982666dee32"},
    {"paper baked field", "728767dd51e88775479458408af23acb00743d323833c000240af1c89ada5e3d"},
    {"paper logits", "56e424adb296950876ab8f3e014143aa29f7599de504457f2c42197769474182"},
    {"paper owner", "d1d9a06b8b8ef9ba275dd5f695f0f96fc03f4855123ed3b9894cebc166f46b56"},
    {"paper renders", "69489ad545e972d162043ff66bb02731b10c7f02530ad977ee8f1da317c9a1e0"},
    {"scene", "15bf0def4f0aafd36af902743d49e9f0b84f3c33f7f1a5522020bce02dc28ac2"}};
